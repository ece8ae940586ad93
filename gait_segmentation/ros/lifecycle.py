# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The base of all nodes: life cycle, inputs joined by stamp, worker thread, services."""

from __future__ import annotations

import faulthandler
import time
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, ClassVar

import cv2
from rclpy.exceptions import InvalidHandle
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, qos_profile_parameters
from std_srvs.srv import SetBool, Trigger

from gait_segmentation.config import StageConfig
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.kernels import compile_kernels, compiling
from gait_segmentation.people import PeopleConfig
from gait_segmentation.ros.diagnostics import Diagnostics
from gait_segmentation.ros.endpoints import BETWEEN_NODES, camera_input, publisher, subscribe
from gait_segmentation.ros.parameters import NodeParameters
from gait_segmentation.stamps import Order, Stamps
from gait_segmentation.streams.backlog import Backlog, Worker
from gait_segmentation.streams.config import (
    BankConfig,
    CameraConfig,
    NodeConfig,
    SegmenterNodeConfig,
)
from gait_segmentation.streams.fields import DEPTH, Parts, slot_topics, stamp_of
from gait_segmentation.streams.health import Statistics, Warnings
from gait_segmentation.streams.join import ExactJoin

_DRAIN_S = 5.0
_SUCCESS = TransitionCallbackReturn.SUCCESS


def _transition(
    what: str,
    action: Callable[[Any], None],
    state: str,
    undo: Callable[[Any], None] | None = None,
) -> Callable[[Any, LifecycleState], TransitionCallbackReturn]:
    """Return a callback of the life cycle that logs what fails, which rclpy would swallow."""

    def callback(node: GaitNode, before: LifecycleState) -> TransitionCallbackReturn:
        try:
            action(node)
        except Exception as error:  # Whatever it is, the node goes on without.
            if node.context.ok():
                node.get_logger().error(f'{what} failed: {type(error).__name__}: {error}')
            if undo is not None:
                undo(node)
            return TransitionCallbackReturn.FAILURE
        node.state = state
        return _SUCCESS

    return callback


class GaitNode(LifecycleNode):
    """
    A node that works on frames, of which all messages have come, in one thread of its own.

    The executor's thread only receives messages, joins them on their stamp and hands frames over;
    stages are touched by the worker alone, so they need no locks.  Derived classes say what comes
    in :attr:`kinds`, and the images of the camera as well if they have a :class:`CameraConfig`,
    and what to do in the methods from :meth:`build` to :meth:`trouble`.
    """

    name: ClassVar[str]
    groups: ClassVar[Sequence[tuple[str, type[StageConfig]]]] = ()
    """Prefix and class of the configurations beside :class:`NodeConfig`."""

    kinds: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """Types of messages by topic of a slot, by the node they come from, in the order of work."""

    packages: ClassVar[Sequence[str]] = ()
    """Whose kernels the stage needs; of all if there is none."""

    restarting: ClassVar[tuple[type[StageConfig], ...]] = ()
    """Configurations that start new paths: what is held back is published before."""

    stage: Any = None
    """What works on frames, from :meth:`build` to the clean-up."""

    bank: TemplateBank
    """What is asked for by :class:`BankConfig`, from :meth:`build` on."""

    camera_topic = ''
    """Of the images, if the node sees, from the activation on."""

    state = 'unconfigured'
    """Of the life cycle."""

    def __init__(self, **options: Any) -> None:
        """
        Declare parameters and services; everything else waits for the life cycle.

        :param options: passed on to rclpy's node.
        :raises ConfigError: if a parameter has a value that is not allowed.
        """
        super().__init__(self.name, **options)
        self.statistics = Statistics()
        self.warnings = Warnings(self.get_logger().warning, time.monotonic)
        self.enabled = True
        self.outputs: list[Publisher] = []
        self.inputs: list[Callable[[], object]] = []
        """What lets go of each input, called at the deactivation."""

        self.topics: dict[str, dict[str, Any]] = {}
        """Types of what comes from other nodes by topic, by the node."""

        self.join: ExactJoin | None = None
        self.unstamped = False
        """Whether the last that came could not be taken in for want of a stamp."""

        self._stamps = Stamps()
        self._worker: Worker | None = None
        self.failure: BaseException | None = None
        """What has ended the worker."""

        groups = [('', NodeConfig), *self.groups]
        self.parameters = NodeParameters(self, groups, changed=self._parameters_changed)
        self._alarm = self.create_guard_condition(self._raise_failure)
        # As many requests may come at a time as to the services of parameters.
        many = {'qos_profile': qos_profile_parameters}
        self.create_service(SetBool, '~/enable', self._enable, **many)
        self.create_service(Trigger, '~/reset', self._reset, **many)
        self._diagnostics = Diagnostics(self)

    # What derived classes do.

    @abstractmethod
    def build(self) -> None:
        """Make stages and publishers, after the kernels are compiled."""

    @abstractmethod
    def process(self, frame: Parts) -> None:
        """Work on a frame, after :meth:`enter`, and publish its outputs (worker)."""

    @abstractmethod
    def process_unusable(self, frame: Parts) -> None:
        """Publish the empty outputs of a frame that cannot be worked on (worker)."""

    def connect(self) -> None:
        """Subscribe to the outputs of the other nodes, and to the camera."""
        self.topics = {node: slot_topics(each, self.slots) for node, each in self.kinds.items()}
        sees = self.has(CameraConfig)
        self.join = self._make_join()
        for topics in self.topics.values():
            for topic, kind in topics.items():
                subscribe(self, kind, topic, partial(self.receive, topic))
        if sees:
            kind, self.camera_topic, profile = camera_input(
                self, self.parameters.get(CameraConfig)
            )
            subscribe(self, kind, self.camera_topic, partial(self.receive, 'image'), profile)

    def drop_tracks(self) -> None:
        """Publish what is held back and drop all tracks, but not what waits (worker)."""
        self.finish()
        self.stage.reset()

    def stand_by(self) -> None:
        """Let go of what waits for the next frame (worker)."""

    def time_was_reset(self) -> None:
        """Do what is to be done once tracks were dropped since stamps went back (worker)."""

    def configured(self) -> Sequence[tuple[Any, str]]:
        """Return the attributes, with their objects, that hold configurations of the stage."""
        return [(self.stage, 'config')]

    def finish(self) -> None:
        """Publish what is held back (worker)."""

    def release(self) -> None:
        """Let go of what the stage holds outside of this process, before the clean-up."""

    def pause(self) -> None:
        """Drop what waits for its other parts: those that come now will be ignored."""
        self.join = self._make_join()

    def status(self) -> dict[str, str]:
        """Return what the diagnostics are to report besides the usual."""
        return {'camera': self.resolve_topic_name('image')} if self.has(CameraConfig) else {}

    def trouble(self) -> str:
        """Return what the diagnostics are to warn of since this was last asked, empty if well."""
        return ''

    # What derived classes use.

    @classmethod
    def has(cls, kind: type[StageConfig]) -> bool:
        """Return whether the node has the parameters of a configuration."""
        return any(each is kind for _, each in cls.groups)

    @property
    def slots(self) -> int:
        """Return how many people there may be."""
        return self.parameters.get(PeopleConfig).max_people

    def output(self, kind: Any, topic: str, profile: QoSProfile = BETWEEN_NODES) -> Any:
        """Make a publisher that lives until the clean-up."""
        self.outputs.append(publisher(self, kind, topic, profile))
        return self.outputs[-1]

    def hand_over(self, stamp_ns: int, frame: Parts) -> None:
        """Give a frame to the worker."""
        self.unstamped = False
        if self._worker is None:
            return
        now = time.monotonic()
        self.statistics.arrived(now, stamp_ns)
        dropped = self._worker.backlog.put((now, stamp_ns, frame))
        if dropped:
            self.statistics.skipped += dropped
            self.warnings.warn_of(dropped, 'cannot keep up: dropped {} that waited')

    def enter(self, stamp_ns: int) -> None:
        """Let a frame in that could be read; a reset of time drops all tracks (worker)."""
        back_s = (self._stamps.newest_ns - stamp_ns) / 1e9
        if self._stamps.take(stamp_ns) is Order.RESET:
            self.warnings.warn(
                'time',
                f'the stamp went back by {back_s:.3f} s (a bag that loops?): everything is reset',
            )
            self.drop_tracks()
            self.time_was_reset()

    def reset(self) -> None:
        """Drop all tracks and what waits for the next frame; any stamp may follow (worker)."""
        self.drop_tracks()
        self.stand_by()
        self._stamps = Stamps()

    def later(self, call: Callable[[], None], kind: str = '', most: int = 1) -> int:
        """Have something done by the worker before the next frame; see :meth:`Backlog.call`."""
        return self._worker.backlog.call(call, kind, most) if self._worker is not None else 0

    def drain(self, timeout_s: float) -> bool:
        """Wait until the worker has done what it was given; return whether it has."""
        return self._worker is None or self._worker.backlog.drain(timeout_s)

    # Life cycle.

    def start(self) -> bool:
        """Configure and activate if the node starts itself; return whether that went well."""
        autostart = self.parameters.get(NodeConfig).autostart
        return not autostart or (
            self.trigger_configure() == _SUCCESS and self.trigger_activate() == _SUCCESS
        )

    def close(self) -> None:
        """Stop the worker and let go of everything."""
        self._disconnect()
        self._tear_down()

    def _configure(self) -> None:
        config = self.parameters.get(NodeConfig)
        self.statistics = Statistics()
        # OpenCV takes 0 as "no threads at all" and a negative number as its default.
        cv2.setNumThreads(config.num_threads or -1)
        # It may take longer than a node may hang; the next turn of the executor watches again.
        faulthandler.cancel_dump_traceback_later()
        with compiling(self.get_logger().info):
            if self.has(BankConfig):
                self.bank = open_bank(self.parameters.get(BankConfig).bank)
            compile_kernels(*self.packages)
        self.build()
        self._worker = Worker(Backlog(config.backlog), self._work, self._worker_failed)

    def _activate(self) -> None:
        self.connect()
        self.statistics.expect(time.monotonic())
        self.get_logger().info('active')

    def _deactivate(self) -> None:
        self._disconnect()
        if self._worker is not None:
            self._worker.backlog.drain(_DRAIN_S)
            self.later(self.reset)
            self._worker.backlog.drain(_DRAIN_S)

    def _make_join(self) -> ExactJoin | None:
        # Images alone are complete as they are.
        if not self.topics:
            return None
        stages = {**({'camera': ['image']} if self.has(CameraConfig) else {}), **self.topics}
        keeps = self.has(SegmenterNodeConfig)
        room = self.parameters.get(SegmenterNodeConfig).keep_images if keeps else DEPTH
        return ExactJoin(stages, room)

    def _disconnect(self) -> None:
        while self.inputs:
            self.inputs.pop()()

    def _tear_down(self) -> None:
        if self._worker is not None:
            self._worker.stop()
            self._worker = None
        while self.outputs:
            self.destroy_publisher(self.outputs.pop())
        if self.stage is not None:
            self.release()
        self.stage = None

    on_configure = _transition('configuring', _configure, 'inactive', _tear_down)
    on_activate = _transition('activating', _activate, 'active', _disconnect)
    on_deactivate = _transition('deactivating', _deactivate, 'inactive')
    on_cleanup = _transition('cleaning up', _tear_down, 'unconfigured')
    on_shutdown = _transition('shutting down', close, 'finalized')

    # Frames.

    def receive(self, part: str, message: Any) -> None:
        """Take in a message of a topic, and hand its frame over if it is complete with it."""
        stamp_ns = stamp_of(message.header)
        if stamp_ns <= 0:
            self.unstamped = True
            self.warnings.warn(
                'no stamp',
                f'a message with the stamp {stamp_ns / 1e9:.9g} s is ignored: stamps tell frames '
                'apart and must be above zero, so the camera driver must set header.stamp',
            )
        elif not self.enabled:
            return
        elif self.join is None:
            self.hand_over(stamp_ns, {part: message})
        else:
            join = self.join
            parts = join.add(part, stamp_ns, message)
            self.statistics.skipped += join.skipped.total()
            self.statistics.incomplete += join.missed.total()
            self._note_stale(join.stale)
            self.warnings.warn_of_missed(join)
            join.skipped.clear()
            join.missed.clear()
            join.stale = 0
            if parts is not None:
                self.hand_over(stamp_ns, parts)

    def _note_stale(self, frames: int) -> None:
        if frames:
            self.statistics.stale += frames
            self.warnings.warn_of(frames, '{} dropped: the stamp is not later than the one before')

    def _work(self, item: tuple[float, int, Parts]) -> None:
        """Work on a frame, or answer one that is of no use empty (worker)."""
        arrived_s, stamp_ns, frame = item
        if self._stamps.order(stamp_ns) is Order.STALE:
            self._note_stale(1)
            return
        try:
            self.process(frame)
        except GaitSegmentationError as error:
            self.statistics.failed += 1
            about = f'frame {type(error).__name__}'
            self.warnings.warn(about, f'a frame cannot be used: {error}')
            self.process_unusable(frame)
        now_s = time.monotonic()
        self.statistics.finished(now_s - arrived_s, now_s)

    def _worker_failed(self, error: BaseException) -> None:
        self.failure = error
        # Which is over if the node was closed meanwhile.
        with suppress(InvalidHandle):
            self._alarm.trigger()

    def _raise_failure(self) -> None:
        """End the process, in the executor's thread: a node whose worker died is no use."""
        if self.failure is not None and self.context.ok():
            raise self.failure

    # Services and parameters.

    def _enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if bool(request.data) != self.enabled:
            self.enabled = bool(request.data)
            if self.enabled:
                self.statistics.expect(time.monotonic())
            else:
                self.pause()
                self.later(self.reset, 'reset')
        response.success = True
        response.message = 'enabled' if self.enabled else 'disabled: frames are ignored'
        return response

    def _reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.later(self.reset, 'reset')
        response.success = self._worker is not None
        response.message = 'reset' if response.success else f'the node is {self.state}'
        return response

    def _parameters_changed(self, config: StageConfig) -> None:
        if isinstance(config, NodeConfig) and self._worker is not None:
            self._worker.backlog.limit = config.backlog
        self.later(lambda: self._apply(config), type(config).__name__)

    def _apply(self, config: StageConfig) -> None:
        """Put a changed configuration into force (worker)."""
        if isinstance(config, self.restarting):
            self.finish()
        for owner, name in self.configured():
            if isinstance(config, type(getattr(owner, name))):
                setattr(owner, name, config)
