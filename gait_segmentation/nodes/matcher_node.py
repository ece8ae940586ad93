# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_matcher``: box and likelihood of a person in, matched template and gait out."""

from __future__ import annotations

import sys
from collections import deque
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import Image, RegionOfInterest

from gait_segmentation.config import StageConfig
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.camera import claimed_shape
from gait_segmentation.ros.config import BankConfig, NodeConfig, SizeConfig
from gait_segmentation.ros.image import read_mono8
from gait_segmentation.ros.join import ExactJoin
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import read_box, stamp_of
from gait_segmentation.ros.outputs import SLOT, DebugOutput, MatchOutputs, matching_picture
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.ros.running import run_node
from gait_segmentation.warm_up import open_bank, warm_up_matcher

__all__ = ['MatcherNode', 'main']

_KEPT = 64
"""Likelihoods kept while their box has not come, and the other way round."""

Parts = dict[str, Any]


class MatcherNode(GaitNode):
    """
    Runs the matching stage.

    Boxes are in source pixels, so the size of the source must be known: from parameters, else
    from ``image_size``, else, where nobody publishes that, it is taken to be the likelihood's.
    """

    groups = (('', BankConfig), ('', SizeConfig), ('matching', MatchingConfig))

    def __init__(self, **options: Any) -> None:
        """Make the node, unconfigured."""
        super().__init__('gait_matcher', **options)
        self._matcher: SequenceMatcher | None = None

    def build(self) -> None:
        """Make the stage, compile it and make the publishers."""
        self._bank = open_bank(self.parameters.get(BankConfig).bank)
        config = self.parameters.get(MatchingConfig)
        warm_up_matcher(self._bank, config)
        self._matcher = SequenceMatcher(self._bank, config)
        self._messages: deque[Parts] = deque()
        self._stamp_ns = 0
        self._results = MatchOutputs(self, self._bank)
        self._debug = DebugOutput(self)

    def connect(self) -> None:
        """Subscribe to the tracker's outputs."""
        sizes = self.parameters.get(SizeConfig)
        self._size: tuple[int, int] | None = None
        self._given = bool(sizes.source_width and sizes.source_height)
        if self._given:
            self._size = (sizes.source_width, sizes.source_height)
        self._unsized: deque[tuple[int, Parts]] = deque(
            maxlen=self.parameters.get(NodeConfig).backlog
        )
        self._join = ExactJoin(('box', 'likelihood'), _KEPT)
        self.input(RegionOfInterest, 'image_size', self._sized, LATCHED)
        self.input(
            PolygonInstanceStamped, f'{SLOT}/box', lambda message: self._part('box', message)
        )
        self.input(Image, f'{SLOT}/likelihood', lambda message: self._part('likelihood', message))

    def release(self) -> None:
        """Let go of the stage."""
        self._matcher = None

    def apply(self, group: str, config: StageConfig) -> None:
        """Put a changed configuration into force; the path begins anew."""
        if self._matcher is not None and isinstance(config, MatchingConfig):
            self.finish()
            self._matcher = SequenceMatcher(self._bank, config)

    def forget(self) -> None:
        """Forget the path."""
        if self._matcher is not None:
            self._matcher.reset()
            self._messages.clear()

    def finish(self) -> None:
        """Publish what the lag holds back."""
        if self._matcher is not None:
            self._publish(self._matcher.flush())

    def process(self, frame: Parts) -> None:
        """Match a frame."""
        assert self._matcher is not None
        header = frame['box'].header
        stamp_ns = stamp_of(header)
        likelihood = read_mono8(frame['likelihood'])
        box, angle = read_box(frame['box'])
        if stamp_ns < self._stamp_ns:
            self.warn('time', 'the stamp went back (a bag that loops?): the path begins anew')
            self.finish()
            self.forget()
        self._stamp_ns = stamp_ns
        results = self._matcher.update(
            likelihood,
            box,
            stamp_ns,
            track_id=int(frame['box'].polygon.id),
            source_size=frame['size'] or likelihood.shape[::-1],
            angle=angle,
        )
        self._messages.append(frame)
        self._publish(results)

    def process_unusable(self, frame: Parts) -> None:
        """Publish that nobody is seen."""
        shape = claimed_shape(frame['likelihood']) or (0, 0)
        self._results.blank(shape, frame['box'].header)
        self._debug.blank(shape, frame['box'].header)

    def _publish(self, results: list[MatchResult]) -> None:
        for match in results:
            message = self._messages.popleft()
            while stamp_of(message['box'].header) != match.stamp_ns:
                message = self._messages.popleft()
            self._results.publish(match, message['box'].header)
            if self._debug.wanted:
                likelihood = read_mono8(message['likelihood'])
                self._debug.publish(matching_picture(likelihood, match), message['box'].header)

    def _part(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        if not self.accept(stamp_ns):
            return
        parts = self._join.add(part, stamp_ns, message)
        if parts is None:
            return
        if self._size is None and self.count_publishers('image_size'):
            self._unsized.append((stamp_ns, parts))
            return
        self.hand_over(stamp_ns, {**parts, 'size': self._size})

    def _sized(self, message: RegionOfInterest) -> None:
        if self._given or not message.width or not message.height:
            return
        self._size = (message.width, message.height)
        while self._unsized:
            stamp_ns, parts = self._unsized.popleft()
            self.hand_over(stamp_ns, {**parts, 'size': self._size})


def main(arguments: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(MatcherNode, arguments)


if __name__ == '__main__':
    sys.exit(main())
