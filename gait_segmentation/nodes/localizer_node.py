# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_localizer``: masks and matches of people in; where they are and how they walk out."""

from __future__ import annotations

import dataclasses
import sys
from functools import partial
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import Image, JointState

from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.localization import LocalizationConfig
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.config import LocalizerNodeConfig
from gait_segmentation.ros.fields import slot_topic, slot_topics
from gait_segmentation.ros.join import ExactJoin
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.localizing import Localizing, PeopleOutputs
from gait_segmentation.ros.messages import read_body, read_gait, stamp_of
from gait_segmentation.ros.running import run_node
from gait_segmentation.ros.waiting import nothing_from, unpublished

__all__ = ['LocalizerNode', 'main']

_TOPICS = {
    'gait_matcher': {'matched_box': PolygonInstanceStamped, 'gait': JointState},
    'gait_segmenter': {'mask': Image},
}
"""Kinds of messages by topic of a slot and by the node they come from."""

_KEPT = 40
"""Frames of which something has not come."""

Parts = dict[str, Any]


class LocalizerNode(GaitNode):
    """
    Say where people are in metres, which way they walk and how fast.

    Reads person_K/mask, person_K/matched_box and person_K/gait, camera_info of their camera and
    registered depth images (depth) if there are any; publishes person_K/pose, person_K/walk,
    markers, boxes, people and people_3d.
    """

    name = 'gait_localizer'
    packages = ('gait_segmentation.localization',)
    groups = (
        ('', PeopleConfig),
        ('', LocalizerNodeConfig),
        ('localization', LocalizationConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        self._slots = self.parameters.get(PeopleConfig).max_people
        self._localizing = Localizing(self)
        self.stage = self._localizing.stage
        self._stamp_ns = 0
        self._results = PeopleOutputs(self, self._slots, located=True)

    def connect(self) -> None:
        """Subscribe to the other nodes' outputs and to the camera's."""
        self._topics = {node: slot_topics(kinds, self._slots) for node, kinds in _TOPICS.items()}
        self._join = ExactJoin(self._topics, _KEPT)
        for topics in self._topics.values():
            for topic, kind in topics.items():
                self.input(kind, topic, partial(self._part, topic))
        self._localizing.connect()

    def missing(self) -> str:
        """Say which node does not publish."""
        absent = (unpublished(self, topics, node) for node, topics in self._topics.items())
        return next(filter(None, absent), '') or nothing_from(
            self._join.waits_for or 'gait_matcher'
        )

    def pause(self) -> None:
        """Drop what waits for its other parts."""
        if self.state == 'active':
            self._join.forget()

    def process(self, frame: Parts) -> None:
        """Locate the people of a frame."""
        header = frame[slot_topic(0, 'mask')].header
        stamp_ns = stamp_of(header)
        if stamp_ns < self._stamp_ns:
            self.stage.reset()
        self._stamp_ns = stamp_ns
        matches = [read_walker(frame, slot) for slot in range(self._slots)]
        masks = [read_mono8(frame[slot_topic(slot, 'mask')]) for slot in range(self._slots)]
        locations = self._localizing.locate(matches, masks, header)
        self._results.publish(matches, masks, locations, header)

    def process_unusable(self, frame: Parts) -> None:
        """Publish that nobody is seen."""
        self._results.publish((), (), (), frame[slot_topic(0, 'mask')].header)

    def _part(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        if not self.accept(stamp_ns):
            return
        parts = self._join.add(part, stamp_ns, message)
        self.note_missed(self._join)
        if parts is not None:
            self.hand_over(stamp_ns, parts)


def read_walker(parts: Parts, slot: int) -> MatchResult:
    """
    Put together what the matcher says of a slot but for the template.

    :raises InputError: if a message cannot be read.
    """
    box = parts[slot_topic(slot, 'matched_box')]
    walk = read_gait(parts[slot_topic(slot, 'gait')])
    return dataclasses.replace(
        MatchResult.nobody(stamp_of(box.header), int(box.polygon.id), (0, 0)),
        body=read_body(box),
        phase=walk.phase,
        phase_rate=walk.rate,
        azimuth=walk.azimuth,
        similarity=walk.similarity,
    )


main = partial(run_node, LocalizerNode)
"""Run the node; see :func:`run_node`."""


if __name__ == '__main__':
    sys.exit(main())
