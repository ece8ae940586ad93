# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The base of all nodes: life cycle, inputs joined by stamp, worker thread, services."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from typing import Any, ClassVar

import cv2
from geometry_msgs.msg import PolygonInstanceStamped
from rclpy.event_handler import QoSMessageLostInfo
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, qos_profile_parameters
from sensor_msgs.msg import CompressedImage, Image, JointState
from std_srvs.srv import SetBool, Trigger

from gait_segmentation.config import StageConfig
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.kernels import compile_kernels, compiling
from gait_segmentation.people import PeopleConfig
from gait_segmentation.ros.diagnostics import Diagnostics, Statistics, Warnings
from gait_segmentation.ros.frames import ExactJoin, Worker
from gait_segmentation.ros.parameters import NodeParameters
from gait_segmentation.ros.qos import BEST_EFFORT, BETWEEN_NODES, publisher, subscription
from gait_segmentation.stamps import Order, Stamps
from gait_segmentation.streams.config import (
    BankConfig,
    CameraConfig,
    NodeConfig,
    SegmenterNodeConfig,
)
from gait_segmentation.streams.fields import QUEUE_DEPTH, Parts, slot_topics, stamp_of

SLOT_TOPICS = {
    'box': ('gait_tracker', PolygonInstanceStamped),
    'likelihood': ('gait_tracker', Image),
    'matched_box': ('gait_matcher', PolygonInstanceStamped),
    'shape_prior': ('gait_matcher', Image),
    'gait': ('gait_matcher', JointState),
    'mask': ('gait_segmenter', Image),
}
"""By topic of a slot the node that it comes from, and its type."""

_DRAIN_S = 5.0
_SUCCESS = TransitionCallbackReturn.SUCCESS


def _transition(
    what: str,
    action: Callable[[Any], None],
    state: str,
    undo: Callable[[Any], None] = lambda node: None,
) -> Callable[[Any, LifecycleState], TransitionCallbackReturn]:
    """Return a callback of the life cycle that logs what fails, which rclpy would swallow."""

    def callback(node: GaitNode, before: LifecycleState) -> TransitionCallbackReturn:
        try:
            action(node)
        except Exception as error:  # Whatever it is, the node goes on without.
            if node.context.ok():
                node.get_logger().error(f'{what} failed: {type(error).__name__}: {error}')
            undo(node)
            return TransitionCallbackReturn.FAILURE
        node.state = state
        return _SUCCESS

    return callback


class GaitNode(LifecycleNode):
    """
    A node that works on frames, of which all messages have come, in one thread of its own.

    The executor's thread only receives messages, joins them on their stamp and hands frames over;
    stages are touched by the worker alone, so they need no locks.  Derived classes say in
    :attr:`reads` what comes besides the images that those with a :class:`CameraConfig` see.
    """

    name: ClassVar[str]
    groups: ClassVar[Sequence[tuple[str, type[StageConfig]]]] = ()
    """Prefix and class of the configurations beside :class:`NodeConfig`."""

    reads: ClassVar[Sequence[str]] = ()
    """Topics of each slot that a frame is made of, besides the image, in the order of work."""

    packages: ClassVar[Sequence[str]] = ()
    """Whose kernels the stage needs; of all if there is none."""

    restarting: ClassVar[tuple[type[StageConfig], ...]] = ()
    """Configurations that start new paths: what is held back is published before."""

    stage: Any = None
    """What works on frames, from :meth:`build` to the clean-up."""

    parts: Sequence[Any] = ()
    """What has the configurations, if that is not the stage itself."""

    bank: TemplateBank
    """What is asked for by :class:`BankConfig`, from :meth:`build` on."""

    camera_topic = ''
    """Of the images, if the node sees, from the activation on."""

    state = 'unconfigured'

    def __init__(self, **options: Any) -> None:
        """Declare parameters and services: a ConfigError says what is not allowed."""
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
        self.trouble = ''
        """What the diagnostics are to warn of."""

        self.unstamped = False
        """Whether the last that came could not be taken in for want of a stamp."""

        self._stamps = Stamps()
        self._worker: Worker | None = None
        groups = [('', NodeConfig), *self.groups]
        self.parameters = NodeParameters(self, groups, self._parameters_changed)
        # As many requests may come at a time as to the services of parameters.
        many = {'qos_profile': qos_profile_parameters}
        self.create_service(SetBool, '~/enable', self._enable, **many)
        self.create_service(Trigger, '~/reset', self._reset, **many)
        self._diagnostics = Diagnostics(self)

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
        self.topics = {}
        for name in self.reads:
            by, kind = SLOT_TOPICS[name]
            self.topics.setdefault(by, {}).update(slot_topics({name: kind}, self.slots))
        self._join_anew()
        for topic, kind in chain.from_iterable(each.items() for each in self.topics.values()):
            self.subscribe(kind, topic, partial(self.receive, topic))
        if self.has(CameraConfig):
            config = self.parameters.get(CameraConfig)
            kind, self.camera_topic = Image, 'image'
            if config.image_transport == 'compressed':
                # As image_transport has it: beside the topic that image is remapped to.
                kind = CompressedImage
                self.camera_topic = f'{self.resolve_topic_name("image")}/compressed'
            profile = BETWEEN_NODES if config.reliability == 'reliable' else BEST_EFFORT
            self.subscribe(kind, self.camera_topic, partial(self.receive, 'image'), profile)

    def finish(self) -> None:
        """Publish what is held back (worker)."""

    def drop_tracks(self) -> None:
        """Publish what is held back and drop all tracks, but not what waits (worker)."""
        self.finish()
        self.stage.reset()

    def status(self) -> dict[str, str]:
        """Return what the diagnostics are to report besides the usual."""
        return {'camera': self.resolve_topic_name('image')} if self.has(CameraConfig) else {}

    @classmethod
    def has(cls, kind: type[StageConfig]) -> bool:
        """Return whether the node has the parameters of a configuration."""
        return any(each is kind for _, each in cls.groups)

    @property
    def slots(self) -> int:
        """Return how many people there may be."""
        return self.parameters.get(PeopleConfig).max_people

    @property
    def failure(self) -> BaseException | None:
        """Return what has ended the worker: the node is no use any more."""
        return None if self._worker is None else self._worker.failure

    @property
    def frame_times_s(self) -> tuple[float, float]:
        """Return the time that a frame takes and that between two, in seconds, 0 if not known."""
        worker = self._worker
        return (0.0, 0.0) if worker is None else (worker.took_s, worker.step_s)

    @property
    def load(self) -> float:
        """Return what frames take over the time between two, see :class:`Worker`."""
        return 0.0 if self._worker is None else self._worker.load

    def output(self, kind: Any, topic: str, profile: QoSProfile = BETWEEN_NODES) -> Any:
        """Make a publisher that lives until the clean-up."""
        self.outputs.append(publisher(self, kind, topic, profile))
        return self.outputs[-1]

    def subscribe(
        self,
        kind: Any,
        topic: str,
        received: Callable[[Any], None],
        profile: QoSProfile = BETWEEN_NODES,
    ) -> None:
        """Subscribe until the deactivation, and warn of what cannot come."""
        # Of frames, which are counted.
        lost = self._lost if topic == self.camera_topic else None
        made = subscription(self, kind, topic, received, profile, self.warnings.warn, lost)
        self.inputs.append(lambda: self.destroy_subscription(made))

    def _lost(self, event: QoSMessageLostInfo) -> None:
        self._dropped(
            event.total_count_change,
            'lost on the way: start the camera with FASTRTPS_DEFAULT_PROFILES_FILE set to '
            'config/fastdds_shm.xml of this package (for this node alone it does not help), or '
            'set reliability to reliable, or image_transport to compressed',
        )

    def enter(self, stamp_ns: int) -> bool:
        """Let a frame in that could be read; return whether time went back: a reset (worker)."""
        back_s = (self._stamps.newest_ns - stamp_ns) / 1e9
        back = self._stamps.take(stamp_ns) is Order.RESET
        if back:
            why = f'the stamp went back by {back_s:.3f} s (a bag that loops?)'
            self.warnings.warn('time', f'{why}: everything is reset')
            self.drop_tracks()
        return back

    def reset(self) -> None:
        """Drop all tracks and what waits for the next frame; any stamp may follow (worker)."""
        self.drop_tracks()
        self.trouble = ''
        self._stamps = Stamps()

    def later(self, call: Callable[[], None], kind: str = '', most: int = 1) -> None:
        """Have something done by the worker before the next frame; see :meth:`Worker.call`."""
        if self._worker is not None:
            self._worker.call(call, kind, most)

    def drain(self, timeout_s: float) -> bool:
        """Wait until the worker has done what it was given; return whether it has."""
        return self._worker is None or self._worker.drain(timeout_s)

    def start(self) -> bool:
        """Configure and activate if the node starts itself; return whether that went well."""
        steps = self.trigger_configure, self.trigger_activate
        autostart = self.parameters.get(NodeConfig).autostart
        return not autostart or all(step() == _SUCCESS for step in steps)

    def close(self) -> None:
        """Stop the worker and let go of everything."""
        self._disconnect()
        self._tear_down()

    def _configure(self) -> None:
        config = self.parameters.get(NodeConfig)
        self.statistics = Statistics()
        # OpenCV takes 0 as "no threads at all" and a negative number as its default.
        cv2.setNumThreads(config.num_threads or -1)
        with compiling(self.get_logger().info):
            if self.has(BankConfig):
                self.bank = open_bank(self.parameters.get(BankConfig).bank)
            compile_kernels(*self.packages)
        self.build()
        self._worker = Worker(config.backlog, self._work)

    def _activate(self) -> None:
        self.connect()
        self.statistics.expect(time.monotonic())
        self.get_logger().info('active')

    def _deactivate(self) -> None:
        self._disconnect()
        self.drain(_DRAIN_S)
        self.later(self.reset)
        self.drain(_DRAIN_S)

    def _join_anew(self) -> None:
        # Images alone are complete as they are.
        if self.topics:
            camera = {'camera': {'image': Image}} if self.has(CameraConfig) else {}
            keeps = self.has(SegmenterNodeConfig)
            room = self.parameters.get(SegmenterNodeConfig).keep_images if keeps else QUEUE_DEPTH
            self.join = ExactJoin(camera | self.topics, room)

    def _disconnect(self) -> None:
        while self.inputs:
            self.inputs.pop()()

    def _tear_down(self) -> None:
        if self._worker is not None:
            self._worker.stop()
            self._worker = None
        while self.outputs:
            self.destroy_publisher(self.outputs.pop())
        self.stage, self.parts = None, ()

    on_configure = _transition('configuring', _configure, 'inactive', _tear_down)
    on_activate = _transition('activating', _activate, 'active', _disconnect)
    on_deactivate = _transition('deactivating', _deactivate, 'inactive')
    on_cleanup = _transition('cleaning up', _tear_down, 'unconfigured')
    on_shutdown = _transition('shutting down', close, 'finalized')

    def receive(self, part: str, message: Any) -> None:
        """Take in a message of a topic, and hand its frame over if it is complete with it."""
        stamp_ns = stamp_of(message.header)
        self.unstamped = stamp_ns <= 0
        if self.unstamped:
            self.warnings.warn(
                'no stamp',
                f'a message with the stamp {stamp_ns / 1e9:.9g} s is ignored: stamps tell frames '
                'apart and must be above zero, so the camera driver must set header.stamp',
            )
            return
        if not self.enabled or self._worker is None:
            return
        parts: Parts | None = {part: message}
        if self.join is not None:
            parts = self.join.add(part, stamp_ns, message)
            for node, frames in self.join.dropped.items():
                self._dropped(
                    frames,
                    f'{node} said nothing of them, or not all of it: it dropped them (its log '
                    'says why), is disabled, was started again, or was later than '
                    f'{self.join.capacity} frames that wait (keep_images of gait_segmenter)',
                )
            self.join.dropped.clear()
        if parts is not None:
            now_s = time.monotonic()
            self.statistics.arrived(now_s, stamp_ns)
            dropped = self._worker.put((now_s, stamp_ns, parts))
            self._dropped(dropped, 'this node cannot keep up (docs: Overload)')

    def _dropped(self, frames: int, why: str) -> None:
        """Count frames that will have no answer, and say why."""
        self.statistics.dropped += frames
        if frames:
            self.warnings.warn(why, f'frames dropped, {self.statistics.dropped} so far: {why}')

    def _work(self, item: tuple[float, int, Parts]) -> None:
        """Work on a frame, or answer one that is of no use empty (worker)."""
        arrived_s, stamp_ns, frame = item
        if self._stamps.order(stamp_ns) is Order.STALE:
            self.statistics.stale += 1
            said = f'{self.statistics.stale} frames stale so far: not later than the one before'
            self.warnings.warn('stale', said)
            return
        try:
            self.process(frame)
        except GaitSegmentationError as error:
            self.statistics.failed += 1
            self.warnings.warn('frame', f'a frame cannot be used: {error}')
            self.process_unusable(frame)
        now_s = time.monotonic()
        self.statistics.finished(now_s - arrived_s, now_s)

    def _enable(self, request: SetBool.Request, _: SetBool.Response) -> SetBool.Response:
        if request.data and not self.enabled:
            self.statistics.expect(time.monotonic())
        elif self.enabled and not request.data:
            # What waits for its other parts waits in vain.
            self._join_anew()
            self.later(self.reset, 'reset')
        self.enabled = bool(request.data)
        said = 'enabled' if self.enabled else 'disabled: frames are ignored'
        return SetBool.Response(success=True, message=said)

    def _reset(self, request: Trigger.Request, _: Trigger.Response) -> Trigger.Response:
        self.later(self.reset, 'reset')
        works = self._worker is not None
        said = 'reset' if works else f'the node is {self.state}'
        return Trigger.Response(success=works, message=said)

    def _parameters_changed(self, config: StageConfig) -> None:
        if isinstance(config, NodeConfig) and self._worker is not None:
            self._worker.limit = config.backlog
        self.later(lambda: self._apply(config), type(config).__name__)

    def _apply(self, config: StageConfig) -> None:
        """Put a changed configuration into force (worker)."""
        if isinstance(config, self.restarting):
            self.finish()
        for owner in self.parts or (self.stage,):
            for name in ('config', 'starting'):
                if isinstance(config, type(getattr(owner, name, None))):
                    setattr(owner, name, config)
