# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Refusing requests to set parameters that rclpy cannot read."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically

if TYPE_CHECKING:
    from rclpy.node import Node

__all__ = ['refuse_unknown_types']

Answer: TypeAlias = Callable[[Any, Any], Any]

_LAST_TYPE = ParameterType.PARAMETER_STRING_ARRAY


def refuse_unknown_types(node: Node) -> None:
    """
    Have a node refuse values of parameters of a type that there is not.

    rclpy lets the error through, which would end the node.
    """
    for service in node.services:
        if service.srv_type in (SetParameters, SetParametersAtomically):
            service.callback = partial(_set, service.callback)


def _set(answer: Answer, request: Any, response: Any) -> Any:
    """Answer a request, or refuse all of it if a type in it is unknown."""
    unknown = [each for each in request.parameters if each.value.type > _LAST_TYPE]
    if not unknown:
        return answer(request, response)
    reason = (
        f'type of {unknown[0].name!r} must be from 0 to {_LAST_TYPE}, got {unknown[0].value.type}'
    )
    refused = SetParametersResult(successful=False, reason=reason)
    if isinstance(request, SetParametersAtomically.Request):
        response.result = refused
    else:
        response.results = [refused] * len(request.parameters)
    return response
