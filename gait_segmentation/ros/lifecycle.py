# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The base of all nodes: life cycle, worker thread, services, diagnostics."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import partial
from typing import Any, ClassVar

import cv2
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile, qos_profile_parameters
from std_srvs.srv import SetBool, Trigger

from gait_segmentation.config import StageConfig
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.held_frames import HeldFrames
from gait_segmentation.kernels import compile_kernels, compiling
from gait_segmentation.ros.diagnostics import QUIET_S, diagnostic_message
from gait_segmentation.ros.endpoints import BETWEEN_NODES, publisher, subscription
from gait_segmentation.ros.guards import (
    ignore_negative_times,
    refuse_what_cannot_be_done,
    time_of,
)
from gait_segmentation.ros.parameters import NodeParameters, state_of
from gait_segmentation.stamps import Order, Stamps
from gait_segmentation.streams.backlog import Backlog, Worker
from gait_segmentation.streams.config import BankConfig, NodeConfig
from gait_segmentation.streams.health import Statistics, Warnings

_DRAIN_S = 5.0
_PATIENCE_S = 10.0
"""Time without input after which it is said what is missing."""

_SUCCESS = TransitionCallbackReturn.SUCCESS


class GaitNode(LifecycleNode):
    """
    A node that works on frames in one thread of its own.

    The executor's thread only receives messages and hands frames over; stages are touched by
    the worker alone, so they need no locks.  Derived classes say what to do in the methods
    from :meth:`build` to :meth:`trouble`.
    """

    name: ClassVar[str]
    groups: ClassVar[Sequence[tuple[str, type[StageConfig]]]] = ()
    """Prefix and class of the configurations beside :class:`NodeConfig`."""

    packages: ClassVar[Sequence[str]] = ()
    """Whose kernels the stage needs; of all if there is none."""

    restarting: ClassVar[tuple[type[StageConfig], ...]] = ()
    """Configurations with which paths begin anew: what is held back is published before."""

    unhurried: Callable[[], AbstractContextManager[None]] = nullcontext
    """Held while kernels are compiled, by whoever watches over the process."""

    stage: Any = None
    """What works on frames, from :meth:`build` to the clean-up."""

    bank: TemplateBank
    """What is asked for by :class:`BankConfig`, from :meth:`build` on."""

    def __init__(self, **options: Any) -> None:
        """
        Declare parameters and services; everything else waits for the life cycle.

        :param options: passed on to rclpy's node.
        :raises ConfigError: if a parameter has a value that is not allowed.
        """
        super().__init__(self.name, **options)
        self.statistics = Statistics()
        self.warnings = Warnings(self.get_logger().warning, time.monotonic)
        ignore_negative_times(self, self.warnings.warn)
        self.enabled = True
        self.held: HeldFrames[Any] = HeldFrames()
        self._stamps = Stamps()
        self._said = self._refused = ''
        self._inputs: list[Callable[[], object]] = []
        self._outputs: list[Any] = []
        self._worker: Worker | None = None
        self._failure: BaseException | None = None
        self.parameters = NodeParameters(
            self, [('', NodeConfig), *self.groups], changed=self._parameters_changed
        )
        self._alarm = self.create_guard_condition(self._raise_failure)
        refuse_what_cannot_be_done(self, self.warnings.warn)
        # As many requests may come at a time as to the services of parameters.
        many = {'qos_profile': qos_profile_parameters}
        self.create_service(SetBool, '~/enable', self._enable, **many)
        self.create_service(Trigger, '~/reset', self._reset, **many)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        # Steady, so that a simulation that stands still is still reported on.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._report, clock=steady)

    # What derived classes do.

    @abstractmethod
    def build(self) -> None:
        """Make stages and publishers, after :meth:`compile`."""

    @abstractmethod
    def connect(self) -> None:
        """Make the subscriptions."""

    @abstractmethod
    def process(self, frame: Any) -> None:
        """Work on a frame, after :meth:`enter`, and publish its outputs (worker)."""

    @abstractmethod
    def process_unusable(self, frame: Any) -> None:
        """Publish the empty outputs of a frame that cannot be worked on (worker)."""

    def forget(self) -> None:
        """Forget everybody, and what is held back (worker)."""
        self._stamps.reset()
        self.held.clear()
        self.stage.reset()

    def start_over(self) -> None:
        """Publish what is held back and forget everybody, for all begins anew (worker)."""
        self.finish()
        self.stage.reset()

    def configured(self) -> Sequence[tuple[Any, str]]:
        """Return the attributes, with their objects, that hold configurations of the stage."""
        return [(self.stage, 'config')]

    def finish(self) -> None:
        """Publish what is held back (worker)."""

    def pause(self) -> None:
        """Drop what waits for its other parts: those that come now will be ignored."""

    @abstractmethod
    def missing(self) -> str:
        """Say what is missing for frames to come."""

    def status(self) -> dict[str, str]:
        """Return what the diagnostics are to report besides the usual."""
        return {}

    def trouble(self) -> str:
        """Return what the diagnostics are to warn of since this was last asked, empty if well."""
        return ''

    def compile(self) -> None:
        """Open the bank, if the stage has one, and have all kernels compiled."""
        if self.has(BankConfig):
            self.bank = open_bank(self.parameters.get(BankConfig).bank)
        compile_kernels(*self.packages)

    # What derived classes use.

    @classmethod
    def has(cls, kind: type[StageConfig]) -> bool:
        """Return whether the node has the parameters of a configuration."""
        return any(each is kind for _, each in cls.groups)

    def output(self, kind: Any, topic: str, profile: QoSProfile = BETWEEN_NODES) -> Any:
        """Make a publisher that lives until the clean-up."""
        made = publisher(self, kind, topic, profile)
        self._outputs.append(made)
        return made

    def input(
        self,
        kind: Any,
        topic: str,
        received: Callable[[Any], None],
        profile: QoSProfile = BETWEEN_NODES,
    ) -> None:
        """Make a subscription that lives until the deactivation."""
        made = subscription(self, kind, topic, profile, received, self.warnings.warn)
        self.keep_input(partial(self.destroy_subscription, made))

    def keep_input(self, close: Callable[[], object]) -> None:
        """Have something called at the deactivation, which lets go of an input."""
        self._inputs.append(close)

    def accept(self, stamp_ns: int) -> bool:
        """Return whether a frame is to be taken in; without a stamp it is refused."""
        if stamp_ns <= 0:
            self._refused = 'what comes has no stamp'
            self.warnings.warn(
                'no stamp',
                f'a message with the stamp {stamp_ns / 1e9:.9g} s is ignored: stamps tell frames '
                'apart and must be above zero, so the camera driver must set header.stamp',
            )
            return False
        return self.enabled

    def hand_over(self, stamp_ns: int, frame: Any) -> None:
        """Give a frame to the worker, which tells late ones and those that come again."""
        self._refused = ''
        if self._worker is None:
            return
        now = time.monotonic()
        self.statistics.arrived(now, stamp_ns)
        dropped = self._worker.backlog.put((now, stamp_ns, frame))
        if dropped:
            self.statistics.skipped += dropped
            self.warnings.warn_of(dropped, 'cannot keep up: dropped {} that waited')

    def enter(self, stamp_ns: int) -> None:
        """Let a frame in that could be read: if time begins anew with it, start over (worker)."""
        back_s = (self._stamps.newest_ns - stamp_ns) / 1e9
        if self._stamps.take(stamp_ns) is Order.ANEW:
            self.warnings.warn(
                'time',
                f'the stamp went back by {back_s:.3f} s (a bag that loops?): everything is reset',
            )
            self.start_over()

    def note_again(self, frames: int) -> None:
        """Count and report frames with stamps that have come before."""
        if frames:
            self.statistics.again += frames
            self.warnings.warn_of(frames, '{} ignored: the stamp had come before')

    def later(self, call: Callable[[], None], kind: str = '', most: int = 1) -> int:
        """Have something done by the worker before the next frame; see :meth:`Backlog.call`."""
        return self._worker.backlog.call(call, kind, most) if self._worker is not None else 0

    @property
    def state(self) -> str:
        """Return the state of the life cycle in words."""
        return state_of(self)

    def start(self) -> bool:
        """Configure and activate if the node starts itself; return whether that went well."""
        autostart = self.parameters.get(NodeConfig).autostart
        return not autostart or (
            self.trigger_configure() == _SUCCESS and self.trigger_activate() == _SUCCESS
        )

    def close(self) -> None:
        """Stop the worker and let go of everything."""
        self._disconnect(drain=False)
        self._tear_down()

    # Life cycle.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build stages, publishers and the worker."""
        return self._transition('configuring', self._configure, self._tear_down)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Subscribe."""
        undo = partial(self._disconnect, drain=False)
        return self._transition('activating', self._activate, undo)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe and finish what was taken in."""
        return self._transition('deactivating', partial(self._disconnect, drain=True))

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let go of stages, publishers and worker."""
        return self._transition('cleaning up', self._tear_down)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let go of everything."""
        return self._transition('shutting down', self.close)

    def _transition(
        self,
        what: str,
        action: Callable[[], None],
        undo: Callable[[], None] = lambda: None,
    ) -> TransitionCallbackReturn:
        try:
            action()
        except Exception as error:  # rclpy would swallow it without a word.
            if self.context.ok():
                self.get_logger().error(f'{what} failed: {type(error).__name__}: {error}')
            undo()
            return TransitionCallbackReturn.FAILURE
        return _SUCCESS

    def _configure(self) -> None:
        config = self.parameters.get(NodeConfig)
        self.statistics = Statistics()
        # OpenCV takes 0 as "no threads at all" and a negative number as its default.
        cv2.setNumThreads(config.num_threads or -1)
        with self.unhurried(), compiling(self.get_logger().info):
            self.compile()
        self.build()
        self._worker = Worker(Backlog(config.backlog), self._work, self._worker_failed)

    def _activate(self) -> None:
        self.connect()
        self.statistics.expect(time.monotonic())
        self.get_logger().info('active')

    def _disconnect(self, drain: bool) -> None:
        for close in self._inputs:
            close()
        self._inputs.clear()
        if drain and self._worker is not None:
            self._worker.backlog.drain(_DRAIN_S)
            self.later(self.finish)
            self.later(self.forget)
            self._worker.backlog.drain(_DRAIN_S)

    def _tear_down(self) -> None:
        if self._worker is not None:
            self._worker.stop()
            self._worker = None
        for output in self._outputs:
            self.destroy_publisher(output)
        self._outputs.clear()
        self.stage = None

    # The worker's thread.

    def _work(self, item: tuple[float, int, Any]) -> None:
        arrived_s, stamp_ns, frame = item
        order = self._stamps.order(stamp_ns)
        if order is Order.AGAIN:
            self.note_again(1)
            return
        if order is Order.LATE:
            self._stamps.take(stamp_ns)
            self.statistics.late += 1
            self.warnings.warn_of(1, '{} came after a later one: nobody is seen in a late one')
            self.process_unusable(frame)
        else:
            try:
                self.process(frame)
            except GaitSegmentationError as error:
                self._stamps.note(stamp_ns)
                self.statistics.failed += 1
                about = f'frame {type(error).__name__}'
                self.warnings.warn(about, f'a frame cannot be used: {error}')
                self.process_unusable(frame)
        now_s = time.monotonic()
        self.statistics.finished(now_s - arrived_s, now_s)

    def _apply(self, config: StageConfig) -> None:
        """Put a changed configuration into force; see :attr:`restarting`."""
        if isinstance(config, self.restarting):
            self.finish()
        for owner, name in self.configured():
            if isinstance(config, type(getattr(owner, name))):
                setattr(owner, name, config)

    def _worker_failed(self, error: BaseException) -> None:
        self._failure = error
        # Which is over if the node was closed meanwhile.
        with suppress(InvalidHandle):
            self._alarm.trigger()

    def _raise_failure(self) -> None:
        """End the process, in the executor's thread: a node whose worker died is no use."""
        if self._failure is not None and self.context.ok():
            raise self._failure

    # Services, parameters and diagnostics.

    def _enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if bool(request.data) != self.enabled:
            self.enabled = bool(request.data)
            if self.enabled:
                self.statistics.expect(time.monotonic())
            else:
                self.pause()
                self.later(self.forget, 'forget')
        response.success = True
        response.message = 'enabled' if self.enabled else 'disabled: frames are ignored'
        return response

    def _reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.later(self.forget, 'forget')
        response.success = self._worker is not None
        response.message = 'reset' if response.success else f'the node is {self.state}'
        return response

    def _parameters_changed(self, config: StageConfig) -> None:
        if isinstance(config, NodeConfig) and self._worker is not None:
            self._worker.backlog.limit = config.backlog
        self.later(lambda: self._apply(config), type(config).__name__)

    def _now(self) -> Time:
        """Return the time of the node's clock; warn if there is none to compare stamps with."""
        now = time_of(self)
        if not (now.sec or now.nanosec) and self.statistics.received:
            self.warnings.warn(
                'no time',
                "the node's clock says nothing above zero, so ages of stamps are not known: with "
                'use_sim_time somebody must publish on /clock',
            )
        return now

    def _missing(self, now_s: float) -> str:
        """Return what an active node has waited for in vain, and log it when it changes."""
        waits = self.state == 'active' and self.enabled
        quiet_s = self.statistics.quiet_s(now_s) if waits else 0.0
        missing = (self._refused or self.missing()) if quiet_s > QUIET_S else ''
        if not missing:
            self._said = ''
        elif quiet_s > _PATIENCE_S and missing != self._said:
            self._said = missing
            self.get_logger().warning(missing)
        return missing

    def _report(self) -> None:
        now_s = time.monotonic()
        details = self.status()
        details['kernels ready'] = str(self._worker is not None).lower()
        for output in self._outputs:
            details[f'subscribers of {output.topic_name}'] = str(output.get_subscription_count())
        self._diagnostics.publish(
            diagnostic_message(
                self.get_fully_qualified_name(),
                self.state if self.enabled else f'{self.state}, disabled',
                self.statistics,
                now_s,
                self._now(),
                details,
                self.trouble(),
                self._missing(now_s),
            )
        )
