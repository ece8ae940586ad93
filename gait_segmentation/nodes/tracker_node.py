# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_tracker``: images in, box and foreground likelihood image of a person out."""

from __future__ import annotations

import sys
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import CompressedImage, Image, RegionOfInterest

from gait_segmentation.config import StageConfig
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.results import Feedback
from gait_segmentation.ros.camera import CameraSubscription, claimed_shape, decode
from gait_segmentation.ros.config import BankConfig, CameraConfig, StartConfig
from gait_segmentation.ros.image import read_mono8
from gait_segmentation.ros.intake import Intake
from gait_segmentation.ros.join import ExactJoin
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import read_body, read_region, stamp_of
from gait_segmentation.ros.outputs import SLOT, DebugOutput, TrackOutputs, tracking_picture
from gait_segmentation.ros.running import run_node
from gait_segmentation.tracking import PersonTracker, TrackingConfig
from gait_segmentation.warm_up import open_bank, warm_up_tracker

__all__ = ['TrackerNode', 'main']

_FEEDBACK_KEPT = 30
"""Incomplete feedback kept; the tracker itself keeps fewer frames to learn from."""


class TrackerNode(GaitNode):
    """Runs the tracking stage."""

    groups = (
        ('', CameraConfig),
        ('', StartConfig),
        ('', BankConfig),
        ('tracking', TrackingConfig),
    )
    with_initial_box = True

    def __init__(self, **options: Any) -> None:
        """Make the node, unconfigured."""
        super().__init__('gait_tracker', **options)
        self._tracker: PersonTracker | None = None
        self._track_id = 0

    def build(self) -> None:
        """Make the stage, compile it and make the publishers."""
        bank = open_bank(self.parameters.get(BankConfig).bank)
        config = self.parameters.get(TrackingConfig)
        warm_up_tracker(bank, config)
        self._tracker = PersonTracker(bank, config)
        self._intake = Intake(
            reset=self._tracker.reset,
            initialize=self._tracker.initialize,
            warn=self.warn,
            initial_box=self.parameters.initial_box,
            initial_stamp_ns=self.parameters.get(StartConfig).initial_box_stamp,
        )
        self._outputs_of_track = TrackOutputs(self)
        self._debug = DebugOutput(self)

    def connect(self) -> None:
        """Subscribe to the camera, to first boxes and to the feedback."""
        self._join = ExactJoin(('mask', 'prior', 'box'), _FEEDBACK_KEPT)
        self.input(Image, f'{SLOT}/mask', lambda message: self._feedback('mask', message))
        self.input(Image, f'{SLOT}/shape_prior', lambda message: self._feedback('prior', message))
        self.input(
            PolygonInstanceStamped,
            f'{SLOT}/matched_box',
            lambda message: self._feedback('box', message),
        )
        self.input(RegionOfInterest, 'init_roi', self._start)
        camera = CameraSubscription(self, self.parameters.get(CameraConfig), self._image)
        self._inputs.append(camera)

    def release(self) -> None:
        """Let go of the stage."""
        self._tracker = None
        self._track_id = 0

    def apply(self, group: str, config: StageConfig) -> None:
        """Put a changed configuration into force."""
        if self._tracker is not None and isinstance(config, TrackingConfig):
            self._tracker.config = config

    def forget(self) -> None:
        """Forget the person."""
        if self._tracker is not None:
            self._tracker.reset()
            self._intake.forget()
            self._track_id = 0

    def status(self) -> dict[str, str]:
        """Report the track."""
        return {'track id': str(self._track_id)}

    def process(self, frame: Image | CompressedImage) -> None:
        """Track a frame."""
        assert self._tracker is not None
        image = decode(frame)
        stamp_ns = stamp_of(frame.header)
        self._intake.take(image, stamp_ns)
        track = self._tracker.update(image, stamp_ns)
        self._track_id = track.track_id
        self._outputs_of_track.publish(track, image.shape[:2], frame.header)
        if self._debug.wanted:
            self._debug.publish(tracking_picture(image, track), frame.header)

    def process_unusable(self, frame: Image | CompressedImage) -> None:
        """Publish that nobody is seen."""
        self._outputs_of_track.blank(frame.header)
        self._debug.blank(claimed_shape(frame) or self._intake.shape or (0, 0), frame.header)

    def _image(self, message: Image | CompressedImage) -> None:
        stamp_ns = stamp_of(message.header)
        if self.accept(stamp_ns):
            self.hand_over(stamp_ns, message)

    def _start(self, message: RegionOfInterest) -> None:
        try:
            box = read_region(message)
        except GaitSegmentationError as error:
            self.warn('roi', f'init_roi is ignored: {error}')
            return
        self.later(lambda: self._intake.request(box))

    def _feedback(self, part: str, message: Any) -> None:
        parts = self._join.add(part, stamp_of(message.header), message)
        if parts is not None and self.enabled:
            self.later(lambda: self._learn(parts))

    def _learn(self, parts: dict[str, Any]) -> None:
        assert self._tracker is not None
        box = parts['box']
        try:
            body = read_body(box)
            if body is None:
                return
            mask, prior = read_mono8(parts['mask']), read_mono8(parts['prior'])
            track_id = int(box.polygon.id)
            self._tracker.learn(Feedback(stamp_of(box.header), track_id, mask, body, prior))
        except GaitSegmentationError as error:
            self.warn('feedback', f'feedback is ignored: {error}')


def main(arguments: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(TrackerNode, arguments)


if __name__ == '__main__':
    sys.exit(main())
