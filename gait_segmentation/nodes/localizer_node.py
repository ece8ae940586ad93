# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_localizer``: masks and matches of people in; where they are and how they walk out."""

from __future__ import annotations

import importlib
from collections import deque
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped
from numpy.typing import NDArray
from rclpy.time import Time
from sensor_msgs.msg import CameraInfo, Image, JointState

from gait_segmentation.errors import GaitSegmentationError, InputError
from gait_segmentation.inputs.encodings import read_depth, read_mono8
from gait_segmentation.localization import (
    CameraPose,
    LocalizationConfig,
    Localizer,
    Location,
    read_camera,
)
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.endpoints import CameraSubscription
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.outputs import Outputs, Seen, people_topics, seen
from gait_segmentation.ros.running import run_node
from gait_segmentation.streams.config import CameraConfig, LocalizerNodeConfig
from gait_segmentation.streams.fields import DEPTH, Parts, read_match, slot_topic, stamp_of
from gait_segmentation.streams.health import shortened

if TYPE_CHECKING:
    from std_msgs.msg import Header


class Localizing:
    """The stage that locates people, and its inputs: camera_info, depth images and tf."""

    def __init__(self, node: GaitNode) -> None:
        """Make the stage."""
        self._node = node
        self.stage = Localizer(node.parameters.get(LocalizationConfig))
        self._info: CameraInfo | None = None
        self._depths: deque[Image] = deque(maxlen=DEPTH)
        self._tf: tuple[Any, type[Exception]] | None = None
        self._unused = ''
        self._told = ''
        self._trouble = ''
        self._located = False
        self._failures = 0

    def connect(self) -> None:
        """Subscribe, until the node's deactivation."""
        node = self._node
        self._depths.clear()
        CameraSubscription(node, CameraConfig(), self._calibrated, 'camera_info', CameraInfo)
        CameraSubscription(node, CameraConfig(), self._depths.append, 'depth')
        if node.parameters.get(LocalizerNodeConfig).ground_frame:
            self._listen()

    def locate(
        self,
        matches: Sequence[MatchResult],
        masks: Sequence[NDArray[np.uint8]],
        header: Header,
    ) -> tuple[Location | None, ...]:
        """
        Locate the people of a frame, one a slot; say why if that cannot be done (worker).

        Whatever happens here ends nothing else.
        """
        people = sum(match.body is not None for match in matches)
        locations: tuple[Location | None, ...] = (None,) * len(matches)
        try:
            locations = self._locate(matches, masks, header)
            why = ', '.join(sorted(set(filter(None, self.stage.reasons))))
        except GaitSegmentationError as error:
            why = str(error)
        except Exception as error:  # The masks are to go on.
            self._failures += 1
            self.stage.reset()
            why = f'{type(error).__name__}: {error}'
        found = sum(location is not None for location in locations)
        self._told = shortened(f'{found} of {people}' + (f', {why}' if why else ''))
        self._located = self._located or found > 0
        if why:
            self._node.warnings.warn('located', f'located: {self._told}')
            # Which the log says by itself.
            self._told += f'; a depth image is not used: {self._unused}' * bool(self._unused)
            self._trouble = f'located: {self._told}'
        return locations

    def status(self) -> dict[str, str]:
        """Return how many people of the last frame are located, and why not all of them are."""
        failures = self._failures + (0 if self.stage is None else self.stage.failures)
        return {'located': self._told or 'no frame yet', 'location errors': str(failures)}

    def trouble(self) -> str:
        """Say why nobody was located since this was last asked, empty if somebody was."""
        trouble = '' if self._located else self._trouble
        self._trouble, self._located = '', False
        return trouble

    def _locate(
        self,
        matches: Sequence[MatchResult],
        masks: Sequence[NDArray[np.uint8]],
        header: Header,
    ) -> tuple[Location | None, ...]:
        """
        Locate the people of a frame.

        :raises InputError: if that cannot be done for anybody.
        """
        if self._info is None:
            topic = self._node.resolve_topic_name('camera_info')
            raise InputError(f'nothing came on {topic} so far')
        rectified = self._node.parameters.get(LocalizerNodeConfig).rectified
        camera = read_camera(self._info, rectified, masks[0].shape if masks else None)
        depth, pose = self._depth(header, masks), self._pose(header)
        if not self._depths and pose is None and not self.stage.config.camera_height:
            topic = self._node.resolve_topic_name('depth')
            raise InputError(
                f'nothing came on {topic} so far, and where the ground is neither '
                'ground_frame nor localization.camera_height says'
            )
        return self.stage.update(matches, masks, camera, pose, depth)

    def _calibrated(self, message: CameraInfo) -> None:
        self._info = message

    def _depth(
        self, header: Header, masks: Sequence[NDArray[np.uint8]]
    ) -> NDArray[np.uint16] | NDArray[np.float32] | None:
        """Return the depth image that belongs to a frame, None if there is none that fits."""
        self._unused = ''
        stamp_ns = stamp_of(header)
        apart = {abs(stamp_of(each.header) - stamp_ns): each for each in list(self._depths)}
        if not apart:
            return None
        apart_s, message = min(apart) * 1e-9, apart[min(apart)]
        try:
            if apart_s > self._node.parameters.get(LocalizerNodeConfig).depth_tolerance:
                raise InputError(
                    f'the nearest of the last is {apart_s:.3f} s apart (depth_tolerance)'
                )
            if message.header.frame_id != header.frame_id:
                raise InputError(
                    'it must be registered to the image: its frame_id is '
                    f"{message.header.frame_id!r}, the image's {header.frame_id!r}"
                )
            if masks and (message.height, message.width) != masks[0].shape:
                raise InputError(
                    f'it must have the size of the image, {masks[0].shape[1]} x '
                    f'{masks[0].shape[0]}, got {message.width} x {message.height}'
                )
            return read_depth(message)
        except InputError as error:
            self._unused = str(error)
            self._node.warnings.warn('depth', f'a depth image is not used: {error}')
            return None

    def _listen(self) -> None:
        try:
            tf2 = importlib.import_module('tf2_ros')
        except ImportError:
            return
        buffer = tf2.Buffer()
        self._tf = buffer, tf2.TransformException
        listener = tf2.TransformListener(buffer, self._node, spin_thread=False)
        self._node.inputs.append(listener.unregister)

    def _pose(self, header: Header) -> CameraPose | None:
        """
        Return where the camera is by tf, None without ground_frame.

        :raises InputError: if tf does not say it.
        """
        frame = self._node.parameters.get(LocalizerNodeConfig).ground_frame
        if not frame:
            return None
        if self._tf is None:
            raise InputError('ground_frame needs the Python package tf2_ros, which is not there')
        buffer, unknown = self._tf
        found = why = None
        # What tf does not know yet of the image's time it may know of the newest.
        for when in (Time.from_msg(header.stamp), Time()):
            try:
                found = buffer.lookup_transform(frame, header.frame_id, when).transform
                break
            except unknown as error:
                why = error
        if found is None:
            raise InputError(f'tf has no way from {header.frame_id!r} to {frame!r}: {why}')
        at, turn = found.translation, found.rotation
        return CameraPose.from_quaternion((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))


class LocalizerNode(GaitNode):
    """
    Say where people are in metres, which way they walk and how fast.

    Reads person_K/mask, person_K/matched_box and person_K/gait, camera_info of their camera and
    registered depth images (depth) if there are any; publishes person_K/pose, person_K/walk,
    markers, boxes and people.
    """

    name = 'gait_localizer'
    kinds: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        'gait_matcher': {'matched_box': PolygonInstanceStamped, 'gait': JointState},
        'gait_segmenter': {'mask': Image},
    }
    packages = ('gait_segmentation.localization',)
    groups = (
        ('', PeopleConfig),
        ('', LocalizerNodeConfig),
        ('localization', LocalizationConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        self.localizing = Localizing(self)
        self.stage = self.localizing.stage
        self._results = Outputs(self, people_topics(self.slots, located=True))

    def process(self, frame: Parts) -> None:
        """Locate the people of a frame."""
        header = frame[slot_topic(0, 'mask')].header
        matches = [read_match(frame, slot) for slot in range(self.slots)]
        masks = [read_mono8(frame[slot_topic(slot, 'mask')]) for slot in range(self.slots)]
        self.enter(stamp_of(header))
        locations = self.localizing.locate(matches, masks, header)
        self._results.publish_made(header, seen, matches, masks, locations)

    def process_unusable(self, frame: Parts) -> None:
        """Publish that nobody is seen."""
        self._results.publish(Seen(), frame[slot_topic(0, 'mask')].header)


main = partial(run_node, LocalizerNode)
"""Run the node; see :func:`run_node`."""
