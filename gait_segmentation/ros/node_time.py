# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of a node, whatever its clock or /clock say."""

from __future__ import annotations

from collections.abc import Callable

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

__all__ = ['ignore_negative_times', 'time_of']


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
