# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_matcher``: boxes and likelihoods of people in, matched templates and gait out."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial

from sensor_msgs.msg import RegionOfInterest
from std_msgs.msg import Header

from gait_segmentation.encodings import claimed_shape
from gait_segmentation.errors import InputError
from gait_segmentation.matching import MatchingConfig, PeopleMatcher
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import Outputs, match_topics
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.ros.running import run_node
from gait_segmentation.stamps import HeldFrames
from gait_segmentation.streams.config import BankConfig
from gait_segmentation.streams.fields import Parts, read_track, slot_topic


class MatcherNode(GaitNode):
    """
    Find how people walk: the path of template silhouettes that fits their likelihoods best.

    Reads person_K/box and person_K/likelihood, from gait_tracker or any node in its place;
    publishes person_K/matched_box, refined_box, shape_prior and gait.  The size of the images
    that boxes are measured in comes on image_size, or is the likelihood's.
    """

    name = 'gait_matcher'
    reads = ('box', 'likelihood')
    restarting = (MatchingConfig,)
    packages = ('gait_segmentation.matching',)
    groups = (
        ('', PeopleConfig),
        ('', BankConfig),
        ('matching', MatchingConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        config = self.parameters.get(MatchingConfig)
        self.stage = PeopleMatcher(self.bank, config, max_people=self.slots)
        self._results = Outputs(self, match_topics(self.slots))
        self._held: HeldFrames[Header] = HeldFrames()

    def connect(self) -> None:
        """Subscribe to the tracker's outputs."""
        self._size: tuple[int, int] | None = None
        # First, so that it is known before the likelihoods are.
        self.subscribe(RegionOfInterest, 'image_size', self._sized, LATCHED)
        super().connect()

    def finish(self) -> None:
        """Publish what the lag holds back."""
        self._publish(self.stage.flush())

    def process(self, frame: Parts) -> None:
        """Match a frame."""
        tracks = [read_track(frame, slot) for slot in range(self.slots)]
        topic = self.resolve_topic_name('image_size')
        if self._size is None and self.count_publishers(topic):
            raise InputError(f'{topic} has a publisher, and nothing has come from it so far')
        self.enter(tracks[0].stamp_ns)
        size = self._size or tracks[0].likelihood.shape[::-1]
        results = self.stage.update(tracks, source_size=size)
        self._held.hold(tracks[0].stamp_ns, frame[slot_topic(0, 'box')].header)
        self._publish(results)

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty results."""
        shape = claimed_shape(frame[slot_topic(0, 'likelihood')]) or (0, 0)
        self._results.blank(shape, frame[slot_topic(0, 'box')].header)

    def _publish(self, results: Sequence[Sequence[MatchResult]]) -> None:
        for matches in results:
            self._results.publish(matches, self._held.take(matches[0].stamp_ns))

    def _sized(self, message: RegionOfInterest) -> None:
        if message.width and message.height:
            self._size = (message.width, message.height)


main = partial(run_node, MatcherNode)
"""Run the node; see :func:`run_node`."""

if __name__ == '__main__':
    sys.exit(main())
