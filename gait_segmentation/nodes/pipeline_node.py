# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_pipeline``: all stages in one node, in lockstep, with the topics of the three nodes."""

from __future__ import annotations

import sys
from collections import deque
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, RegionOfInterest

from gait_segmentation.config import StageConfig
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.pipeline import PersonResult, Pipeline, PipelineConfig
from gait_segmentation.ros.camera import CameraSubscription, claimed_shape, decode
from gait_segmentation.ros.config import BankConfig, CameraConfig, StartConfig
from gait_segmentation.ros.intake import Intake
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import read_region, stamp_of
from gait_segmentation.ros.outputs import (
    DebugOutput,
    MatchOutputs,
    SegmentationOutputs,
    TrackOutputs,
    segmentation_picture,
)
from gait_segmentation.ros.running import run_node
from gait_segmentation.segmentation import SegmentationConfig
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.warm_up import open_bank, warm_up

__all__ = ['PipelineNode', 'main']

Message: TypeAlias = Image | CompressedImage


class PipelineNode(GaitNode):
    """Runs the pipeline."""

    groups = (
        ('', CameraConfig),
        ('', StartConfig),
        ('', BankConfig),
        ('tracking', TrackingConfig),
        ('matching', MatchingConfig),
        ('segmentation', SegmentationConfig),
    )
    with_initial_box = True

    def __init__(self, **options: Any) -> None:
        """Make the node, unconfigured."""
        super().__init__('gait_pipeline', **options)
        self._pipeline: Pipeline | None = None
        self._track_id = 0

    def build(self) -> None:
        """Make the stages, compile them and make the publishers."""
        get = self.parameters.get
        bank = open_bank(get(BankConfig).bank)
        config = PipelineConfig(get(TrackingConfig), get(MatchingConfig), get(SegmentationConfig))
        warm_up(config, bank)
        self._pipeline = Pipeline(config, bank)
        self._waiting: deque[tuple[NDArray[np.uint8], Message]] = deque()
        self._intake = Intake(
            reset=self._start_over,
            initialize=self._pipeline.initialize,
            warn=self.warn,
            initial_box=self.parameters.initial_box,
            initial_stamp_ns=get(StartConfig).initial_box_stamp,
        )
        self._track = TrackOutputs(self)
        self._match = MatchOutputs(self, bank)
        self._segmentation = SegmentationOutputs(self)
        self._debug = DebugOutput(self)

    def connect(self) -> None:
        """Subscribe to the camera and to first boxes."""
        self.input(RegionOfInterest, 'init_roi', self._start)
        camera = CameraSubscription(self, self.parameters.get(CameraConfig), self._image)
        self._inputs.append(camera)

    def release(self) -> None:
        """Let go of the stages."""
        self._pipeline = None
        self._track_id = 0

    def apply(self, group: str, config: StageConfig) -> None:
        """Put a changed configuration into force."""
        if self._pipeline is None:
            return
        if isinstance(config, TrackingConfig):
            self._pipeline.tracker.config = config
        elif isinstance(config, SegmentationConfig):
            self._pipeline.segmenter.config = config
        elif isinstance(config, MatchingConfig):
            self.finish()
            self._pipeline.matcher = SequenceMatcher(self._pipeline.bank, config)

    def forget(self) -> None:
        """Forget the person."""
        if self._pipeline is not None:
            self._pipeline.reset()
            self._intake.forget()
            self._waiting.clear()
            self._track_id = 0

    def finish(self) -> None:
        """Publish what the lag holds back."""
        if self._pipeline is not None:
            self._publish(self._pipeline.flush())

    def status(self) -> dict[str, str]:
        """Report the track."""
        return {'track id': str(self._track_id)}

    def process(self, frame: Message) -> None:
        """Run a frame through all stages."""
        assert self._pipeline is not None
        image = decode(frame)
        stamp_ns = stamp_of(frame.header)
        self._intake.take(image, stamp_ns)
        results = self._pipeline.update(image, stamp_ns)
        self._waiting.append((image, frame))
        self._publish(results)

    def process_unusable(self, frame: Message) -> None:
        """Publish that nobody is seen."""
        shape = claimed_shape(frame) or self._intake.shape or (0, 0)
        self._track.blank(frame.header)
        self._match.blank(self._track.likelihood_shape, frame.header)
        self._segmentation.blank(shape, frame.header)
        self._debug.blank(shape, frame.header)

    def _publish(self, results: list[PersonResult]) -> None:
        for result in results:
            image, message = self._waiting.popleft()
            while stamp_of(message.header) != result.stamp_ns:
                image, message = self._waiting.popleft()
            header = message.header
            self._track_id = result.track.track_id
            self._track.publish(result.track, image.shape[:2], header)
            self._match.publish(result.match, header)
            self._segmentation.publish(result.segmentation, header)
            if self._debug.wanted:
                mask = result.segmentation.mask
                box = Box.around(mask) if result.match.body is not None else None
                self._debug.publish(segmentation_picture(image, mask, box, result.match), header)

    def _start_over(self) -> None:
        self.finish()
        assert self._pipeline is not None
        self._pipeline.reset()
        self._waiting.clear()

    def _image(self, message: Message) -> None:
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


def main(arguments: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(PipelineNode, arguments)


if __name__ == '__main__':
    sys.exit(main())
