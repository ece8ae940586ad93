# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Transitions of the life cycle that a node's state does not have: refused, not fatal."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from lifecycle_msgs.srv import ChangeState
from rclpy.impl.implementation_singleton import rclpy_implementation

if TYPE_CHECKING:
    from rclpy.lifecycle import LifecycleNode

__all__ = ['refuse_impossible', 'state_of']

Change = Callable[[ChangeState.Request, ChangeState.Response], ChangeState.Response]


def state_of(node: LifecycleNode) -> str:
    """Return the state of a node's life cycle in words."""
    return str(node._state_machine.current_state[1])


def refuse_impossible(node: LifecycleNode) -> None:
    """
    Have a node answer a transition that its state does not have with a warning and a refusal.

    rclpy lets the error through, which would end the node.
    """
    service = node._service_change_state
    service.callback = partial(_change, node, service.callback)


def _change(
    node: LifecycleNode,
    change: Change,
    request: ChangeState.Request,
    response: ChangeState.Response,
) -> ChangeState.Response:
    try:
        return change(request, response)
    except rclpy_implementation.RCLError:
        if not node.context.ok():
            raise
        asked = request.transition.label or _label(node, request.transition.id)
        possible = [label for _, label, *_ in node._state_machine.available_transitions]
        node.get_logger().warning(
            f'the node is {state_of(node)}, so {asked} is ignored; now there is: '
            + ', '.join(possible)
        )
        response.success = False
        return response


def _label(node: LifecycleNode, number: int) -> str:
    known = {each: label for each, label, *_ in node._state_machine.transition_graph}
    return str(known.get(number, f'transition {number}'))
