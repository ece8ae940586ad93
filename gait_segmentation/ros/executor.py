# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An executor that takes messages without gathering everything anew for each."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import timeout_sec_to_nsec
from rclpy.waitable import NumberOfEntities

_LOOK_S = 0.2
"""How soon is noticed what another thread has changed while nothing comes."""


class MessageExecutor(SingleThreadedExecutor):
    """
    Runs callbacks in one thread, those of subscriptions with little ado.

    rclpy's executor gathers all entities of its nodes twice for every message, which takes more
    time than the message: with three nodes two of twenty milliseconds a frame.  This one gathers
    them when they have changed and calls the callbacks of subscriptions, which must be plain
    functions of the message, itself.  Timers, services, events and guard conditions, which are
    rare, are left to rclpy.  Its experimental events executor (7.1.6) would do all of this, but
    spins on for ever after a signal.
    """

    _changed = False

    def spin(self) -> None:
        """
        Execute callbacks until the executor or the context is shut down.

        :raises ExternalShutdownException: if the context is while rclpy is waiting.
        """
        while self.context.ok() and self._run_what_is_ready():
            self._changed = False
            with ExitStack() as held:
                entities = _Entities(self, held)
                while self.context.ok() and entities.deliver() and not self._changed:
                    pass

    def wake(self) -> None:
        """Have everything gathered anew, because something has changed."""
        self._changed = True
        super().wake()

    def _run_what_is_ready(self) -> bool:
        """Run all callbacks as rclpy does; return whether there may be more later."""
        try:
            while True:
                run, _, _ = self.wait_for_ready_callbacks(timeout_sec=0)
                run()
                error = run.exception()
                if error is not None:
                    raise error
        except TimeoutException:
            return bool(self.context.ok())
        except ShutdownException:
            return False


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

        self._waitables = of_nodes('waitables')
        # In the order of NumberOfEntities.
        self._entities = {
            'subscription': of_nodes('subscriptions'),
            'guard_condition': of_nodes('guards'),
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

    def deliver(self) -> bool:
        """Wait and call back with messages; return whether there is nothing else to be done."""
        waiting = self._wait_set
        ready: dict[str, Any] = {}
        # If something has been destroyed since, all is to be gathered anew.
        with suppress(InvalidHandle):
            # A wait leaves it empty.
            waiting.clear_entities()
            for kind, entities in self._entities.items():
                add = getattr(waiting, f'add_{kind}')
                for each in entities:
                    add(each.handle)
            for waitable in self._waitables:
                waitable.add_to_wait_set(waiting)
            waiting.wait(timeout_sec_to_nsec(_LOOK_S))
            ready = {kind: waiting.get_ready_entities(kind) for kind in self._entities}
        messages = ready.get('subscription', ())
        for each in self._entities['subscription']:
            if each.handle.pointer in messages:
                taken = None
                # The callback before may have destroyed it.
                with suppress(InvalidHandle), each.handle:
                    taken = each.handle.take_message(each.msg_type, each.raw)
                if taken is not None:
                    each.callback(taken[0])
        for guard in self._entities['guard_condition']:
            # To have waited for it has taken it back.
            if guard.handle.pointer in ready.get('guard_condition', ()):
                guard.trigger()
        others = any(each for kind, each in ready.items() if kind != 'subscription')
        return bool(messages) and not (
            others or any(each.is_ready(waiting) for each in self._waitables)
        )


def _held(entities: list[Any], held: ExitStack) -> list[Any]:
    """Keep entities from being destroyed; return them without those that just are."""
    found = []
    for each in entities:
        with suppress(InvalidHandle):
            held.enter_context(each.handle if hasattr(each, 'handle') else each)
            found.append(each)
    return found
