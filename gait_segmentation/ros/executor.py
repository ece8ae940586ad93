# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An executor that takes messages without gathering everything anew for each."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ExternalShutdownException,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerGuardCondition
from rclpy.task import Task
from rclpy.utilities import get_default_context
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

    def __init__(self, *, context: Context | None = None) -> None:
        """Make an executor without nodes; the context is the default one if None."""
        context = get_default_context() if context is None else context
        self._over = False
        # Before all else, which may already want it woken.
        self._wakes = [
            GuardCondition(None, None, context),
            SignalHandlerGuardCondition(context),
        ]
        super().__init__(context=context)

    def spin(self) -> None:
        """
        Execute callbacks until the executor is shut down.

        :raises ExternalShutdownException: if the context is.
        """
        while self.context.ok() and not self._over:
            with ExitStack() as held:
                entities = _Entities(self, held)
                others = False
                # Asked after the gathering, which may have come too late for the last wake.
                while not (others or self._over):
                    subscriptions, others = entities.wait()
                    if not self.context.ok():
                        raise ExternalShutdownException
                    for subscription in subscriptions:
                        _deliver(subscription)
            self._run_what_is_ready()

    def wake(self) -> None:
        """Have everything gathered anew, because something has changed."""
        super().wake()
        self._wake()

    def add_node(self, node: Node) -> bool:
        """Add a node; return whether it is new."""
        added = super().add_node(node)
        self._wake()
        return bool(added)

    def remove_node(self, node: Node) -> None:
        """Remove a node."""
        super().remove_node(node)
        self._wake()

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task:
        """Have something called by the thread that spins."""
        task = super().create_task(callback, *args, **kwargs)
        self._wake()
        return task

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """End the spinning; return whether all callbacks have ended within the time."""
        self._over = True
        self._wake()
        ended = super().shutdown(timeout_sec)
        while self._wakes:
            self._wakes.pop().destroy()
        return bool(ended)

    def wake_conditions(self) -> list[GuardCondition]:
        """Return the guard conditions that are triggered by changes, signals and the end."""
        return list(self._wakes)

    def _wake(self) -> None:
        # Another thread may just be shutting down.
        with suppress(InvalidHandle, IndexError):
            self._wakes[0].trigger()

    def _run_what_is_ready(self) -> None:
        with suppress(ShutdownException, TimeoutException):
            while not self._over:
                run, _, _ = self.wait_for_ready_callbacks(timeout_sec=0)
                run()
                error = run.exception()
                if error is not None:
                    raise error


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
