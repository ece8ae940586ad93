# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Transitions of the life cycle: configuring beside the executor, and what is not possible.

rclpy does a transition within a callback, so that a node that compiles answers nothing, and lets
the error of an impossible one end the node.
"""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable, Generator
from concurrent.futures import Future, wait
from functools import partial
from typing import TYPE_CHECKING

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

if TYPE_CHECKING:
    from rclpy.lifecycle import LifecycleNode

__all__ = ['CONFIGURING', 'Aside', 'configure', 'serve_transitions', 'state_of']

CONFIGURING = 'configuring'
"""The state of a node that compiles."""

_CONFIGURE = 'configure'
_TURN_S = 0.05

Change = Callable[[ChangeState.Request, ChangeState.Response], ChangeState.Response]


class Aside(Future[None]):
    """
    Something done in a thread of its own, which a coroutine of an executor can wait for.

    rclpy takes up a coroutine that waits whenever the executor wakes.  So each time this waits a
    moment for the thread, which costs nothing, and then gives way to the other callbacks.
    """

    def __init__(self, work: Callable[[], None], wake: Callable[[], None]) -> None:
        """
        Begin.

        :param wake: wakes the executor when the work has ended; called in the other thread.
        """
        super().__init__()
        self.add_done_callback(lambda _: wake())
        threading.Thread(target=self._run, args=[work], name='compiler', daemon=True).start()

    def __await__(self) -> Generator[None, None, None]:
        """Wait until it has ended, however; others have their turn once at least."""
        while True:
            wait([self], _TURN_S)
            yield
            if self.done():
                return

    def _run(self, work: Callable[[], None]) -> None:
        try:
            self.set_result(work())
        except Exception as error:  # Handed on to whoever asks for the result.
            self.set_exception(error)


def state_of(node: LifecycleNode) -> str:
    """Return the state of a node's life cycle in words."""
    return str(node._state_machine.current_state[1])


async def configure(
    node: LifecycleNode, prepare: Callable[[], Awaitable[None]]
) -> TransitionCallbackReturn:
    """
    Configure a node, as its ``trigger_configure`` does, but with something to wait for before.

    :param prepare: does what takes long while other callbacks run.
    :raises RCLError: if the node is not unconfigured.
    """
    machine = node._state_machine
    number, label = machine.current_state
    machine.trigger_transition_by_id(Transition.TRANSITION_CONFIGURE, True)
    await prepare()
    result = node.on_configure(LifecycleState(label=label, state_id=number))
    machine.trigger_transition_by_label(result.to_label(), True)
    return result


def serve_transitions(node: LifecycleNode, prepare: Callable[[], Awaitable[None]]) -> None:
    """
    Have a node configure beside the executor, and refuse transitions that its state does not have.

    While it configures, requests for other transitions wait; all other services are answered.
    """
    service = node._service_change_state
    service.callback = partial(_change, node, service.callback, prepare)
    # Of its own: a callback that waits would keep back all others of its group.
    service.callback_group = MutuallyExclusiveCallbackGroup()
    service.callback_group.add_entity(service)


async def _change(
    node: LifecycleNode,
    change: Change,
    prepare: Callable[[], Awaitable[None]],
    request: ChangeState.Request,
    response: ChangeState.Response,
) -> ChangeState.Response:
    while state_of(node) == CONFIGURING:
        await prepare()
    asked = request.transition.label or _label(node, request.transition.id)
    try:
        if asked != _CONFIGURE:
            return change(request, response)
        result = await configure(node, prepare)
        response.success = result == TransitionCallbackReturn.SUCCESS
    except rclpy_implementation.RCLError:
        if not node.context.ok():
            raise
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
