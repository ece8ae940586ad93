# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_tracker``: images in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import Image

from gait_segmentation.config import StageConfig
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.gait_model import open_bank
from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.nodes.camera_node import CameraNode
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import Feedback
from gait_segmentation.ros.camera import CameraMessage, claimed_shape, decode
from gait_segmentation.ros.config import BankConfig, CameraConfig
from gait_segmentation.ros.join import ExactJoin
from gait_segmentation.ros.messages import read_body, stamp_of
from gait_segmentation.ros.outputs import DebugOutput, TrackOutputs
from gait_segmentation.ros.pictures import tracking_picture
from gait_segmentation.ros.running import run_node
from gait_segmentation.ros.topics import slot_topic, slot_topics
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import PeopleTracker, TrackingConfig

__all__ = ['TrackerNode', 'main']

_FEEDBACK_KEPT = 30
"""Feedback that may be incomplete or wait; the tracker itself keeps fewer frames to learn from."""

_FEEDBACK = {'mask': Image, 'shape_prior': Image, 'matched_box': PolygonInstanceStamped}


class TrackerNode(CameraNode):
    """
    Track people in the images of a camera: where each one is, and how likely each pixel is theirs.

    Reads image, init_roi (a box of somebody to track) and the masks that come back from
    gait_segmenter; publishes person_K/box and person_K/likelihood for gait_matcher.
    """

    def __init__(self, **options: Any) -> None:
        """Make the node, unconfigured."""
        super().__init__('gait_tracker', **options)
        self._tracker: PeopleTracker | None = None

    def compile(self) -> None:
        """Open the bank and compile the stage."""
        self._bank = open_bank(self.parameters.get(BankConfig).bank)
        compile_kernels()

    def build(self) -> None:
        """Make the stage and the publishers."""
        get = self.parameters.get
        self._slots = get(PeopleConfig).max_people
        self._tracker = PeopleTracker(
            self._bank, get(TrackingConfig), max_people=self._slots, starting=get(StartingConfig)
        )
        self.take_from(initialize=self._tracker.initialize)
        self._results = TrackOutputs(self, self._slots)
        self._debug = DebugOutput(self)

    def connect(self) -> None:
        """Subscribe to the feedback, to the camera and to first boxes."""
        parts = slot_topics(_FEEDBACK, self._slots)
        self._join = ExactJoin({'feedback': parts}, _FEEDBACK_KEPT)
        for topic, kind in parts.items():
            self.input(kind, topic, partial(self._feedback, topic))
        super().connect()

    def release(self) -> None:
        """Let go of the stage."""
        self._tracker = None
        self.show(())

    def apply(self, group: str, config: StageConfig) -> None:
        """Put a changed configuration into force."""
        if self._tracker is None:
            return
        if isinstance(config, TrackingConfig):
            self._tracker.config = config
        elif isinstance(config, StartingConfig):
            self._tracker.starting = config

    def forget(self) -> None:
        """Forget everybody."""
        if self._tracker is not None:
            self._tracker.reset()
            self.intake.forget()
            self.show(())

    def start_over(self) -> None:
        """Forget everybody, but not the boxes that wait."""
        assert self._tracker is not None
        self._tracker.reset()

    def process(self, frame: CameraMessage) -> None:
        """Track a frame."""
        assert self._tracker is not None
        image = decode(frame, self.parameters.get(CameraConfig))
        stamp_ns = stamp_of(frame.header)
        self.intake.take(image, stamp_ns)
        tracks = self._tracker.update(image, stamp_ns)
        self.show(tracks)
        self._results.publish(tracks, image.shape[:2], frame.header)
        if self._debug.wanted:
            self._debug.publish(tracking_picture(image, tracks), frame.header)

    def process_unusable(self, frame: CameraMessage) -> None:
        """Publish that nobody is seen."""
        self._results.blank(frame.header)
        self._debug.blank(claimed_shape(frame) or self.intake.shape or (0, 0), frame.header)

    def _feedback(self, part: str, message: Any) -> None:
        parts = self._join.add(part, stamp_of(message.header), message)
        if parts is not None and self.enabled:
            dropped = self.later(lambda: self._learn(parts), 'feedback', _FEEDBACK_KEPT)
            if dropped:
                self.warnings.warn_of(
                    dropped,
                    'the feedback of {} was dropped: there was no time to learn from it before '
                    'more came',
                )

    def _learn(self, parts: dict[str, Any]) -> None:
        assert self._tracker is not None
        try:
            feedback = [read_feedback(parts, slot) for slot in range(self._slots)]
            self._tracker.learn([each for each in feedback if each is not None])
        except GaitSegmentationError as error:
            self.warnings.warn('feedback', f'feedback is ignored: {error}')


def read_feedback(parts: dict[str, Any], slot: int) -> Feedback | None:
    """
    Put the feedback for a slot together, None if it was empty.

    :raises InputError: if a message cannot be read.
    """
    mask, prior, box = (parts[slot_topic(slot, name)] for name in _FEEDBACK)
    track_id, body = int(box.polygon.id), read_body(box)
    if not track_id:
        return None
    return Feedback(stamp_of(box.header), track_id, read_mono8(mask), body, read_mono8(prior))


def main(arguments: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(TrackerNode, arguments)


if __name__ == '__main__':
    sys.exit(main())
