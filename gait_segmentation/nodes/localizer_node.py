# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_localizer``: masks and matches of people in; where they are and how they walk out."""

from __future__ import annotations

import importlib
import sys
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.time import Time
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from gait_segmentation.encodings import read_depth, read_mono8
from gait_segmentation.errors import GaitSegmentationError, InputError
from gait_segmentation.localization import (
    CameraPose,
    LocalizationConfig,
    Localizer,
    Location,
    read_camera,
)
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.diagnostics import shortened
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import Outputs, people_topics, seen
from gait_segmentation.ros.qos import BEST_EFFORT
from gait_segmentation.ros.running import run_node
from gait_segmentation.streams.config import LocalizerNodeConfig
from gait_segmentation.streams.fields import QUEUE_DEPTH, Parts, read_match, slot_topic, stamp_of


class LocalizerNode(GaitNode):
    """
    Say where people are in metres, in which direction they walk and how fast.

    Reads person_K/mask, person_K/matched_box and person_K/gait, camera_info of their camera and
    registered depth images (depth) if there are any; publishes person_K/pose, person_K/walk,
    markers, boxes and people.
    """

    name = 'gait_localizer'
    reads = ('matched_box', 'gait', 'mask')
    packages = ('gait_segmentation.localization',)
    groups = (
        ('', PeopleConfig),
        ('', LocalizerNodeConfig),
        ('localization', LocalizationConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        self.stage = Localizer(self.parameters.get(LocalizationConfig))
        self._results = Outputs(self, people_topics(self.slots))
        self._info: CameraInfo | None = None
        self._depths: deque[Image] = deque(maxlen=QUEUE_DEPTH)
        self._tf: tuple[Any, type[Exception]] | None = None
        self._depth_unused = self._located_text = ''

    def connect(self) -> None:
        """Subscribe, until the deactivation."""
        self._depths.clear()
        self.subscribe(CameraInfo, 'camera_info', self._calibrated, BEST_EFFORT)
        self.subscribe(Image, 'depth', lambda depth: self._depths.append(depth), BEST_EFFORT)
        if self.parameters.get(LocalizerNodeConfig).ground_frame:
            with suppress(ImportError):
                tf2 = importlib.import_module('tf2_ros')
                self._tf = tf2.Buffer(), tf2.TransformException
                listener = tf2.TransformListener(self._tf[0], self, spin_thread=False)
                self.inputs.append(listener.unregister)
        super().connect()

    def process(self, frame: Parts) -> None:
        """Locate the people of a frame; say why if that cannot be done."""
        header = frame[slot_topic(0, 'mask')].header
        matches = [read_match(frame, slot) for slot in range(self.slots)]
        masks = [read_mono8(frame[slot_topic(slot, 'mask')]) for slot in range(self.slots)]
        self.enter(stamp_of(header))
        people = sum(match.body is not None for match in matches)
        locations: Sequence[Location | None] = (None,) * len(matches)
        try:
            locations = self._locate(matches, masks, header)
            why = ', '.join(sorted(set(filter(None, self.stage.reasons))))
        except GaitSegmentationError as error:
            why = str(error)
        found = sum(location is not None for location in locations)
        self._located_text = shortened(f'{found} of {people}' + (f', {why}' if why else ''))
        if why:
            self.warnings.warn('located', f'located: {self._located_text}')
            # Which the log says by itself.
            unused = f'; a depth image is not used: {self._depth_unused}'
            self._located_text += unused * bool(self._depth_unused)
        self.trouble = f'located: {self._located_text}' if why and not found else ''
        self._results.publish_made(header, seen, matches, masks, locations)

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty results."""
        self._results.publish(([], [None] * self.slots), frame[slot_topic(0, 'mask')].header)

    def status(self) -> dict[str, str]:
        """Report how many people of the last frame are located, and why not all of them are."""
        if self.stage is None:
            return {}
        told = self._located_text or 'no frame yet'
        return {'located': told, 'location errors': str(self.stage.failures)}

    def _locate(
        self, matches: Sequence[MatchResult], masks: Sequence[NDArray[np.uint8]], header: Header
    ) -> Sequence[Location | None]:
        """Locate the people of a frame; an InputError says why that cannot be done for any."""
        if self._info is None:
            topic = self.resolve_topic_name('camera_info')
            raise InputError(f'nothing came on {topic} so far')
        rectified = self.parameters.get(LocalizerNodeConfig).rectified
        camera = read_camera(self._info, rectified, masks[0].shape)
        depth, pose = self._depth(header, masks[0].shape), self._camera_pose(header)
        if not self._depths and pose is None and not self.stage.config.camera_height:
            topic = self.resolve_topic_name('depth')
            raise InputError(
                f'nothing came on {topic} so far, and where the ground is neither '
                'ground_frame nor localization.camera_height says'
            )
        return self.stage.update(matches, masks, camera, pose, depth)

    def _calibrated(self, message: CameraInfo) -> None:
        self._info = message

    def _depth(
        self, header: Header, shape: tuple[int, ...]
    ) -> NDArray[np.uint16] | NDArray[np.float32] | None:
        """Return the depth image that belongs to a frame, None if there is none that fits."""
        self._depth_unused = ''
        stamp_ns = stamp_of(header)
        apart = {abs(stamp_of(each.header) - stamp_ns): each for each in list(self._depths)}
        if not apart:
            return None
        apart_s, message = min(apart) * 1e-9, apart[min(apart)]
        try:
            if apart_s > self.parameters.get(LocalizerNodeConfig).depth_tolerance:
                raise InputError(
                    f'the nearest of the last is {apart_s:.3f} s apart (depth_tolerance)'
                )
            if message.header.frame_id != header.frame_id:
                raise InputError(
                    'it must be registered to the image: its frame_id is '
                    f"{message.header.frame_id!r}, the image's {header.frame_id!r}"
                )
            if (message.height, message.width) != shape:
                raise InputError(
                    f'it must have the size of the image, {shape[1]} x {shape[0]}, got '
                    f'{message.width} x {message.height}'
                )
            return read_depth(message)
        except InputError as error:
            self._depth_unused = str(error)
            self.warnings.warn('depth', f'a depth image is not used: {error}')
            return None

    def _camera_pose(self, header: Header) -> CameraPose | None:
        """Return where the camera is by tf, None without ground_frame; it may raise InputError."""
        frame = self.parameters.get(LocalizerNodeConfig).ground_frame
        if not frame:
            return None
        if self._tf is None:
            raise InputError('ground_frame needs the Python package tf2_ros, which is not there')
        buffer, unknown = self._tf
        why = None
        # What tf does not know yet of the image's time it may know of the newest.
        for when in (Time.from_msg(header.stamp), Time()):
            try:
                found = buffer.lookup_transform(frame, header.frame_id, when).transform
            except unknown as error:
                why = error
            else:
                at, turn = found.translation, found.rotation
                place, way = (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)
                return CameraPose.from_quaternion(place, way)
        raise InputError(f'tf has no transform from {header.frame_id!r} to {frame!r}: {why}')


main = partial(run_node, LocalizerNode)
"""Run the node; see :func:`run_node`."""

if __name__ == '__main__':
    sys.exit(main())
