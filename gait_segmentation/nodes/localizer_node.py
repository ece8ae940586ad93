# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_localizer``: masks and matches of people in; where they are and how they walk out."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import Image, JointState

from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.localization import LocalizationConfig
from gait_segmentation.people import PeopleConfig
from gait_segmentation.ros.joined_node import JoinedNode, Parts, read_match
from gait_segmentation.ros.localizing import Localizing
from gait_segmentation.ros.messages import stamp_of
from gait_segmentation.ros.outputs import Outputs, Seen, people_topics, seen
from gait_segmentation.ros.running import run_node
from gait_segmentation.streams.config import LocalizerNodeConfig
from gait_segmentation.streams.fields import slot_topic

__all__ = ['LocalizerNode', 'main']


class LocalizerNode(JoinedNode):
    """
    Say where people are in metres, which way they walk and how fast.

    Reads person_K/mask, person_K/matched_box and person_K/gait, camera_info of their camera and
    registered depth images (depth) if there are any; publishes person_K/pose, person_K/walk,
    markers, boxes and people.
    """

    name = 'gait_localizer'
    kinds: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        'gait_matcher': {'matched_box': PolygonInstanceStamped, 'gait': JointState},
        'gait_segmenter': {'mask': Image},
    }
    packages = ('gait_segmentation.localization',)
    groups = (
        ('', PeopleConfig),
        ('', LocalizerNodeConfig),
        ('localization', LocalizationConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        self._localizing = Localizing(self)
        self.stage = self._localizing.stage
        self._results = Outputs(self, people_topics(self.slots, located=True))

    def connect(self) -> None:
        """Subscribe to the other nodes' outputs and to the camera's."""
        super().connect()
        self._localizing.connect()

    def status(self) -> dict[str, str]:
        """Report who is located, and why not."""
        located = {} if self.stage is None else self._localizing.status()
        return {**super().status(), **located}

    def trouble(self) -> str:
        """Say why nobody is located."""
        return '' if self.stage is None else self._localizing.trouble()

    def process(self, frame: Parts) -> None:
        """Locate the people of a frame."""
        header = frame[slot_topic(0, 'mask')].header
        matches = [read_match(frame, slot) for slot in range(self.slots)]
        masks = [read_mono8(frame[slot_topic(slot, 'mask')]) for slot in range(self.slots)]
        self.enter(stamp_of(header))
        locations = self._localizing.locate(matches, masks, header)
        self._results.publish_made(header, seen, matches, masks, locations)

    def process_unusable(self, frame: Parts) -> None:
        """Publish that nobody is seen."""
        self._results.publish(Seen(), frame[slot_topic(0, 'mask')].header)


main = partial(run_node, LocalizerNode)
"""Run the node; see :func:`run_node`."""


if __name__ == '__main__':
    sys.exit(main())
