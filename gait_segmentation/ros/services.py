# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Services that answer whatever is asked, and however much at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.qos import qos_profile_parameters

__all__ = ['add_service', 'refuse_what_cannot_be_done']


def add_service(node: Node, kind: Any, name: str, answer: Callable[[Any, Any], Any]) -> None:
    """Make a service that takes as many requests at a time as those of parameters do."""
    node.create_service(kind, name, answer, qos_profile=qos_profile_parameters)


def refuse_what_cannot_be_done(node: Node, warn: Callable[[str, str], object]) -> None:
    """
    Have a node refuse requests that rclpy raises an error for, which would end the node.

    Such are values of a type that there is not, and transitions that the state does not allow.

    :param warn: called with a key and a text.
    """
    for service in node.services:
        service.callback = partial(_answer, service.callback, service.srv_name, warn)


def _answer(
    answer: Callable[[Any, Any], Any],
    name: str,
    warn: Callable[[str, str], object],
    request: Any,
    response: Any,
) -> Any:
    try:
        return answer(request, response)
    except Exception as error:  # Of rclpy, which has many.
        warn(name, f'a request to {name} is refused: {error}')
        refused = SetParametersResult(successful=False, reason=str(error))
        if isinstance(request, SetParameters.Request):
            # Of those before it is known what became of them.
            missing = len(request.parameters) - len(response.results)
            response.results.extend([refused] * missing)
        elif isinstance(request, SetParametersAtomically.Request):
            response.result = refused
        return response
