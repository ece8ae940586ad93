# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_pipeline``: all stages in one node, in lockstep, with the topics of the three nodes."""

from __future__ import annotations

import sys
from functools import partial

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

from gait_segmentation.drawing import segmentation_picture
from gait_segmentation.encodings import claimed_shape
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.nodes.camera_node import CameraNode
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.ros.messages import (
    Outputs,
    mask_topics,
    match_topics,
    picture_topics,
    track_topics,
)
from gait_segmentation.ros.running import run_node
from gait_segmentation.segmentation import PeopleMasks, SegmentationConfig
from gait_segmentation.stamps import HeldFrames
from gait_segmentation.starting import StartingConfig
from gait_segmentation.streams.fields import Parts
from gait_segmentation.tracking import TrackingConfig


class PipelineNode(CameraNode):
    """
    Track people in the images of a camera and cut them out, all in one process.

    Reads image and init_roi (a box of a person to track); publishes mask, labels, and what
    gait_tracker, gait_matcher and gait_segmenter publish.
    """

    name = 'gait_pipeline'
    restarting = (MatchingConfig,)
    groups = (
        *CameraNode.groups,
        ('matching', MatchingConfig),
        ('segmentation', SegmentationConfig),
    )

    def build(self) -> None:
        """Make the stages and the publishers."""
        kinds = TrackingConfig, MatchingConfig, SegmentationConfig, PeopleConfig, StartingConfig
        config = PipelineConfig(*map(self.parameters.get, kinds))
        self.stage = Pipeline(config, self.bank, scheduler=self.make_scheduler())
        self.parts = self.stage.tracker, self.stage.matcher, self.stage.segmenter
        self.make_intake()
        self._held: HeldFrames[tuple[NDArray[np.uint8], Header]] = HeldFrames()
        self._likelihood: tuple[int, ...] = (0, 0)
        self._track = Outputs(self, track_topics(self.slots))
        self._match = Outputs(self, match_topics(self.slots))
        self._segmentation = Outputs(self, mask_topics(self.slots))
        self._debug = Outputs(self, picture_topics())

    def finish(self) -> None:
        """Publish what the lag holds back."""
        self._publish(self.stage.flush())

    def process(self, frame: Parts) -> None:
        """Run a frame through all stages."""
        image, stamp_ns = self.take_image(frame)
        results = self.stage.update(image, stamp_ns, learn=False)
        self._held.hold(stamp_ns, (image, frame['image'].header))
        self._publish(results)
        self.stage.apply_feedback()

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty results."""
        shape = claimed_shape(frame['image']) or self.intake.shape or (0, 0)
        header = frame['image'].header
        self._segmentation.blank(shape, header)
        for outputs in (self._track, self._match):
            outputs.blank(self._likelihood, header)
        self._debug.blank((*shape, 3), header)

    def _publish(self, results: list[FrameResult]) -> None:
        for result in results:
            image, header = self._held.take(result.stamp_ns)
            tracks = [person.track for person in result.people]
            matches = [person.match for person in result.people]
            found = tuple(person.segmentation for person in result.people)
            masks = PeopleMasks(found, result.mask, result.labels)
            self.tracks = tracks
            self._likelihood = tracks[0].likelihood.shape
            # First what most listen to.
            self._segmentation.publish(masks, header)
            self._track.publish(tracks, header)
            self._match.publish(matches, header)
            self._debug.publish_made(header, segmentation_picture, image, masks, matches, tracks)


main = partial(run_node, PipelineNode)
"""Run the node; see :func:`run_node`."""

if __name__ == '__main__':
    sys.exit(main())
