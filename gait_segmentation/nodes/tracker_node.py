# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_tracker``: images in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.nodes.camera_node import CameraNode
from gait_segmentation.ros.frames import ExactJoin
from gait_segmentation.ros.lifecycle import SLOT_TOPICS
from gait_segmentation.ros.messages import Outputs, track_topics
from gait_segmentation.ros.running import run_node
from gait_segmentation.starting import StartingConfig
from gait_segmentation.streams.fields import (
    FEEDBACK,
    QUEUE_DEPTH,
    Parts,
    read_feedback,
    slot_topics,
    stamp_of,
)
from gait_segmentation.tracking import PeopleTracker, TrackingConfig


class TrackerNode(CameraNode):
    """
    Track people in the images of a camera: where each one is, and how likely each pixel is theirs.

    Reads image, init_roi (a box of a person to track) and the masks that come back from
    gait_segmenter; publishes person_K/box and person_K/likelihood for gait_matcher.
    """

    name = 'gait_tracker'

    def build(self) -> None:
        """Make the stage and the publishers."""
        get = self.parameters.get
        self.stage = PeopleTracker(
            self.bank,
            get(TrackingConfig),
            max_people=self.slots,
            starting=get(StartingConfig),
            scheduler=self.make_scheduler(),
        )
        self.make_intake()
        self._likelihood: tuple[int, ...] = (0, 0)
        self._results = Outputs(self, track_topics(self.slots))

    def connect(self) -> None:
        """Subscribe to the feedback, to the camera and to first boxes."""
        kinds = slot_topics({name: SLOT_TOPICS[name][1] for name in FEEDBACK}, self.slots)
        self._lessons = ExactJoin({'feedback': kinds}, QUEUE_DEPTH)
        for topic, kind in kinds.items():
            self.subscribe(kind, topic, partial(self._feedback, topic))
        super().connect()

    def process(self, frame: Parts) -> None:
        """Track a frame."""
        image, stamp_ns = self.take_image(frame)
        self.tracks = self.stage.update(image, stamp_ns)
        self._likelihood = self.tracks[0].likelihood.shape
        self._results.publish(self.tracks, frame['image'].header)

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty results."""
        self._results.blank(self._likelihood, frame['image'].header)

    def _feedback(self, part: str, message: Any) -> None:
        parts = self._lessons.add(part, stamp_of(message.header), message)
        if parts is not None and self.enabled:
            self.later(lambda: self._learn(parts), 'feedback', QUEUE_DEPTH)

    def _learn(self, parts: Parts) -> None:
        try:
            feedback = [read_feedback(parts, slot) for slot in range(self.slots)]
            self.stage.learn([each for each in feedback if each is not None])
        except GaitSegmentationError as error:
            self.warnings.warn('feedback', f'feedback is ignored: {error}')


main = partial(run_node, TrackerNode)
"""Run the node; see :func:`run_node`."""

if __name__ == '__main__':
    sys.exit(main())
