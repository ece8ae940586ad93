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
from rclpy.utilities import get_default_context, timeout_sec_to_nsec
from rclpy.waitable import NumberOfEntities

__all__ = ['MessageExecutor']


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
        nodes = executor.get_nodes()

        def of_nodes(name: str) -> list[Any]:
            return _held([each for node in nodes for each in getattr(node, name)], held)

        self._guards, self._waitables = of_nodes('guards'), of_nodes('waitables')
        # In the order of NumberOfEntities.
        self._entities = {
            'subscription': of_nodes('subscriptions'),
            'guard_condition': [*self._guards, *_held(executor.wake_conditions(), held)],
            'timer': of_nodes('timers'),
            'client': of_nodes('clients'),
            'service': of_nodes('services'),
        }
        count = NumberOfEntities(*map(len, self._entities.values()))
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
            # A wait leaves it empty.
            waiting.clear_entities()
            for kind, entities in self._entities.items():
                add = getattr(waiting, f'add_{kind}')
                for each in entities:
                    add(each.handle)
            for waitable in self._waitables:
                waitable.add_to_wait_set(waiting)
        except InvalidHandle:
            # Something has been destroyed since: all is to be gathered anew.
            return [], True
        waiting.wait(timeout_sec_to_nsec(None))
        ready = {kind: waiting.get_ready_entities(kind) for kind in self._entities}
        messages = ready.pop('subscription')
        for guard in self._guards:
            # To have waited for it has taken it back.
            if guard.handle.pointer in ready['guard_condition']:
                guard.trigger()
        others = any(ready.values()) or any(each.is_ready(waiting) for each in self._waitables)
        subscriptions = self._entities['subscription']
        return [each for each in subscriptions if each.handle.pointer in messages], others


def _held(entities: list[Any], held: ExitStack) -> list[Any]:
    """Keep entities from being destroyed; return them without those that just are."""
    found = []
    for each in entities:
        with suppress(InvalidHandle):
            held.enter_context(getattr(each, 'handle', each))
            found.append(each)
    return found
