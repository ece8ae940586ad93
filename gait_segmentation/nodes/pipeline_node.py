# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_pipeline``: all stages in one node, in lockstep, with the topics of the three nodes."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig
from gait_segmentation.gait_model import open_bank
from gait_segmentation.held_frames import HeldFrames
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.nodes.camera_node import CameraNode
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.ros.camera import CameraMessage, claimed_shape, decode
from gait_segmentation.ros.config import BankConfig, CameraConfig
from gait_segmentation.ros.messages import stamp_of
from gait_segmentation.ros.outputs import (
    DebugOutput,
    MatchOutputs,
    SegmentationOutputs,
    TrackOutputs,
)
from gait_segmentation.ros.pictures import segmentation_picture
from gait_segmentation.ros.running import run_node
from gait_segmentation.segmentation import PeopleMasks, SegmentationConfig
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import TrackingConfig

__all__ = ['PipelineNode', 'main']


class PipelineNode(CameraNode):
    """
    Track people in the images of a camera and cut them out, all in one process.

    Reads image and init_roi (a box of somebody to track); publishes mask, labels, and what
    gait_tracker, gait_matcher and gait_segmenter publish.
    """

    groups = (
        *CameraNode.groups,
        ('matching', MatchingConfig),
        ('segmentation', SegmentationConfig),
    )

    def __init__(self, **options: Any) -> None:
        """Make the node, unconfigured."""
        super().__init__('gait_pipeline', **options)
        self._pipeline: Pipeline | None = None

    def compile(self) -> None:
        """Open the bank and compile the stages."""
        self._bank = open_bank(self.parameters.get(BankConfig).bank)
        compile_kernels()

    def build(self) -> None:
        """Make the stages and the publishers."""
        config = self._config()
        self._pipeline = Pipeline(config, self._bank)
        self._held: HeldFrames[tuple[NDArray[np.uint8], CameraMessage]] = HeldFrames()
        self.take_from(initialize=self._pipeline.initialize)
        slots = config.people.max_people
        self._track = TrackOutputs(self, slots)
        self._match = MatchOutputs(self, self._bank, slots)
        self._segmentation = SegmentationOutputs(self, slots)
        self._debug = DebugOutput(self)

    def release(self) -> None:
        """Let go of the stages."""
        self._pipeline = None
        self.show(())

    def apply(self, group: str, config: StageConfig) -> None:
        """Put a changed configuration into force."""
        if self._pipeline is None:
            return
        if isinstance(config, TrackingConfig):
            self._pipeline.tracker.config = config
        elif isinstance(config, StartingConfig):
            self._pipeline.tracker.starting = config
        elif isinstance(config, SegmentationConfig):
            self._pipeline.segmenter.config = config
        elif isinstance(config, MatchingConfig):
            self.finish()
            self._pipeline.matcher.config = config

    def forget(self) -> None:
        """Forget everybody."""
        if self._pipeline is not None:
            self._pipeline.reset()
            self.intake.forget()
            self._held.clear()
            self.show(())

    def start_over(self) -> None:
        """Publish what is held back and forget everybody, but not the boxes that wait."""
        self.finish()
        assert self._pipeline is not None
        self._pipeline.reset()
        self._held.clear()

    def finish(self) -> None:
        """Publish what the lag holds back."""
        if self._pipeline is not None:
            self._publish(self._pipeline.flush())

    def process(self, frame: CameraMessage) -> None:
        """Run a frame through all stages."""
        assert self._pipeline is not None
        image = decode(frame, self.parameters.get(CameraConfig))
        stamp_ns = stamp_of(frame.header)
        self.intake.take(image, stamp_ns)
        results = self._pipeline.take(image, stamp_ns)
        self._held.hold(stamp_ns, (image, frame))
        self._publish(results)
        self._pipeline.learn()

    def process_unusable(self, frame: CameraMessage) -> None:
        """Publish that nobody is seen."""
        shape = claimed_shape(frame) or self.intake.shape or (0, 0)
        self._segmentation.blank(shape, frame.header)
        self._track.blank(frame.header)
        self._match.blank(self._track.likelihood_shape, frame.header)
        self._debug.blank(shape, frame.header)

    def _config(self) -> PipelineConfig:
        get = self.parameters.get
        return PipelineConfig(
            get(TrackingConfig),
            get(MatchingConfig),
            get(SegmentationConfig),
            get(PeopleConfig),
            get(StartingConfig),
        )

    def _publish(self, results: list[FrameResult]) -> None:
        for result in results:
            image, message = self._held.take(result.stamp_ns)
            header = message.header
            tracks = [person.track for person in result.people]
            matches = [person.match for person in result.people]
            found = tuple(person.segmentation for person in result.people)
            masks = PeopleMasks(found, result.mask, result.labels)
            self.show(tracks)
            # First what most listen to.
            self._segmentation.publish(masks, header)
            self._track.publish(tracks, image.shape[:2], header)
            self._match.publish(matches, header)
            if self._debug.wanted:
                self._debug.publish(segmentation_picture(image, masks, matches), header)


def main(arguments: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(PipelineNode, arguments)


if __name__ == '__main__':
    sys.exit(main())
