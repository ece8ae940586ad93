# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeps a node alive where rclpy would raise an error: odd requests, and odd clocks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from builtin_interfaces.msg import Time
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rosgraph_msgs.msg import Clock


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


def ignore_negative_times(node: Node, warn: Callable[[str, str], object]) -> None:
    """
    Have a node live on when a time below zero comes on /clock, which rclpy raises an error for.

    :param warn: called with a key and a text.
    """
    source = node._time_source
    take = source.clock_callback

    def received(message: Clock) -> None:
        if message.clock.sec < 0:
            seconds = message.clock.sec + message.clock.nanosec / 1e9
            warn('clock', f'the time {seconds:.9g} s on /clock is ignored: it is below zero')
            return
        take(message)

    source.clock_callback = received
    # With use_sim_time it has subscribed already.
    if source._clock_sub is not None:
        source._clock_sub.callback = received


def time_of(node: Node) -> Time:
    """Return the time of a node's clock, 0 while it is not known or below zero."""
    try:
        return node.get_clock().now().to_msg()
    except ValueError:
        return Time()
