# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An executor that takes messages without gathering everything anew for each."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.waitable import NumberOfEntities

__all__ = ['MessageExecutor']

_FOREVER = -1


class MessageExecutor(SingleThreadedExecutor):
    """
    Runs callbacks in one thread, those of subscriptions with little ado.

    rclpy's executor gathers all entities of its nodes twice for every message, which takes more
    time than the message.  This one gathers them when they have changed and calls the callbacks
    of subscriptions, which must be plain functions of the message, itself.  Timers, services,
    events and guard conditions, which are rare, are left to rclpy.  Its experimental events
    executor (7.1.6) would do all of this, but spins on for ever after a signal.
    """

    def spin(self) -> None:
        """
        Execute callbacks until the executor is shut down.

        :raises ExternalShutdownException: if the context is.
        """
        while self._context.ok() and not self._is_shutdown:
            with ExitStack() as held:
                entities = _Entities(self, held)
                others = False
                # Asked after the gathering, which may have come too late for the last wake.
                while not (others or self._is_shutdown):
                    subscriptions, others = entities.wait()
                    if not self._context.ok():
                        raise ExternalShutdownException
                    for subscription in subscriptions:
                        _deliver(subscription)
            if not self._is_shutdown:
                # It wakes the executor after each callback, so that none is left waiting.
                self.spin_once(timeout_sec=0)

    def wake_conditions(self) -> list[Any]:
        """Return the guard conditions that are triggered when entities change or at the end."""
        return [each for each in (self._guard, self._sigint_gc) if each is not None]


def _deliver(subscription: Any) -> None:
    """Take a message and call back with it."""
    taken = None
    # The callback before may have destroyed it.
    with suppress(InvalidHandle), subscription.handle:
        taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    if taken is not None:
        subscription.callback(taken[0])


class _Entities:
    """What the nodes of an executor wait for, as it is now."""

    def __init__(self, executor: MessageExecutor, held: ExitStack) -> None:
        """
        Gather everything.

        :param held: keeps the entities from being destroyed until it is closed.
        """

        def hold(entities: list[Any]) -> list[Any]:
            found = []
            for each in entities:
                # One that is just being destroyed.
                with suppress(InvalidHandle):
                    held.enter_context(getattr(each, 'handle', each))
                    found.append(each)
            return found

        nodes = executor.get_nodes()
        self._subscriptions = hold([each for node in nodes for each in node.subscriptions])
        self._timers = hold([each for node in nodes for each in node.timers])
        self._clients = hold([each for node in nodes for each in node.clients])
        self._services = hold([each for node in nodes for each in node.services])
        self._guards = hold([each for node in nodes for each in node.guards])
        self._wakes = hold(executor.wake_conditions())
        self._waitables = hold([each for node in nodes for each in node.waitables])
        count = NumberOfEntities(
            len(self._subscriptions),
            len(self._guards) + len(self._wakes),
            len(self._timers),
            len(self._clients),
            len(self._services),
        )
        for waitable in self._waitables:
            count += waitable.get_num_entities()
        context = executor.context.handle
        held.enter_context(context)
        self._wait_set = rclpy_implementation.WaitSet(
            count.num_subscriptions,
            count.num_guard_conditions,
            count.num_timers,
            count.num_clients,
            count.num_services,
            count.num_events,
            context,
        )

    def wait(self) -> tuple[list[Any], bool]:
        """Return the subscriptions with a message, and whether there is anything else to do."""
        waiting = self._wait_set
        try:
            self._fill()
        except InvalidHandle:
            # Something has been destroyed since: all is to be gathered anew.
            return [], True
        waiting.wait(_FOREVER)
        ready = waiting.get_ready_entities
        messages = ready('subscription')
        guards = ready('guard_condition')
        for guard in self._guards:
            # To have waited for it has taken it back.
            if guard.handle.pointer in guards:
                guard.trigger()
        others = bool(guards or ready('timer') or ready('client') or ready('service'))
        others |= any(each.is_ready(waiting) for each in self._waitables)
        return [each for each in self._subscriptions if each.handle.pointer in messages], others

    def _fill(self) -> None:
        """Put everything into the wait set, which a wait leaves empty."""
        waiting = self._wait_set
        waiting.clear_entities()
        for subscription in self._subscriptions:
            waiting.add_subscription(subscription.handle)
        for timer in self._timers:
            waiting.add_timer(timer.handle)
        for client in self._clients:
            waiting.add_client(client.handle)
        for service in self._services:
            waiting.add_service(service.handle)
        for guard in (*self._guards, *self._wakes):
            waiting.add_guard_condition(guard.handle)
        for waitable in self._waitables:
            waitable.add_to_wait_set(waiting)
