# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_segmenter``: images, likelihoods and matched templates in, silhouettes out."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import Image, JointState

from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.camera import claimed_shape, decode
from gait_segmentation.ros.config import CameraConfig, SegmenterNodeConfig
from gait_segmentation.ros.fields import slot_topic, slot_topics
from gait_segmentation.ros.join import ExactJoin
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import read_body, read_gait, stamp_of
from gait_segmentation.ros.outputs import DebugOutput, SegmentationOutputs
from gait_segmentation.ros.pictures import segmentation_picture
from gait_segmentation.ros.running import run_node
from gait_segmentation.ros.waiting import no_images, nothing_from, unpublished
from gait_segmentation.segmentation import PeopleSegmenter, SegmentationConfig

__all__ = ['SegmenterNode', 'main']

_TOPICS = {
    'gait_tracker': {'likelihood': Image},
    'gait_matcher': {
        'matched_box': PolygonInstanceStamped,
        'shape_prior': Image,
        'gait': JointState,
    },
}
"""Kinds of messages by topic of a slot and by the node they come from."""

Parts = dict[str, Any]


class SegmenterNode(GaitNode):
    """
    Cut people out of the images of a camera, with what gait_tracker and gait_matcher found.

    Reads image, person_K/likelihood, person_K/matched_box, person_K/shape_prior and
    person_K/gait; publishes mask (everybody), labels (who is where) and person_K/mask.
    """

    name = 'gait_segmenter'
    packages = ('gait_segmentation.segmentation',)
    groups = (
        ('', CameraConfig),
        ('', PeopleConfig),
        ('', SegmenterNodeConfig),
        ('segmentation', SegmentationConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        config = self.parameters.get(SegmentationConfig)
        people = self.parameters.get(PeopleConfig)
        self._slots = people.max_people
        self.stage = PeopleSegmenter(config, max_people=self._slots, threads=people.people_threads)
        self._shape: tuple[int, int] | None = None
        self._stamp_ns = 0
        self._results = SegmentationOutputs(self, self._slots)
        self._debug = DebugOutput(self)

    def connect(self) -> None:
        """Subscribe to the camera and to the other nodes' outputs."""
        self._topics = {node: slot_topics(kinds, self._slots) for node, kinds in _TOPICS.items()}
        self._join = ExactJoin(
            {'camera': ['image'], **self._topics},
            self.parameters.get(SegmenterNodeConfig).keep_images,
        )
        for topics in self._topics.values():
            for topic, kind in topics.items():
                self.input(kind, topic, partial(self._part, topic))
        self.camera_input(partial(self._part, 'image'))

    def missing(self) -> str:
        """Say whether it is the camera or another node that does not publish."""
        if not self.count_publishers(self.resolve_topic_name(self.camera_topic)):
            return no_images(self, self.camera_topic)
        absent = (unpublished(self, topics, node) for node, topics in self._topics.items())
        silent = self._join.waits_for
        return next(filter(None, absent), '') or (
            nothing_from(silent) if silent in self._topics else no_images(self, self.camera_topic)
        )

    def pause(self) -> None:
        """Drop what waits for its other parts."""
        if self.state == 'active':
            self._join.forget()

    def status(self) -> dict[str, str]:
        """Report the topic of the camera."""
        return {'camera': self.resolve_topic_name(self.camera_topic)}

    def process(self, frame: Parts) -> None:
        """Segment a frame."""
        header = frame['image'].header
        stamp_ns = stamp_of(header)
        image = decode(frame['image'], self.parameters.get(CameraConfig))
        shape = (image.shape[0], image.shape[1])
        if stamp_ns < self._stamp_ns or self._shape not in (None, shape):
            self.warnings.warn(
                'reset', 'the stamp went back or the image size changed: starting anew'
            )
            self.stage.reset()
        self._stamp_ns, self._shape = stamp_ns, shape
        slots = range(self._slots)
        likelihoods = [read_mono8(frame[slot_topic(slot, 'likelihood')]) for slot in slots]
        matches = [read_match(frame, slot) for slot in slots]
        masks = self.stage.update(image, likelihoods, matches)
        self._results.publish(masks, header)
        if self._debug.wanted:
            self._debug.publish(segmentation_picture(image, masks, matches), header)

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty masks."""
        header = frame['image'].header
        shape = claimed_shape(frame['image']) or self._shape or (0, 0)
        self._results.blank(shape, header)
        self._debug.blank(shape, header)

    def _part(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        if not self.accept(stamp_ns):
            return
        parts = self._join.add(part, stamp_ns, message)
        self.note_missed(self._join, 'raise keep_images')
        if parts is not None:
            self.hand_over(stamp_ns, parts)


def read_match(parts: Parts, slot: int) -> MatchResult:
    """
    Put the matcher's messages about a slot together again.

    What the segmentation does not need (template, placement) is not sent.

    :raises InputError: if a message cannot be read.
    """
    box, prior, gait = (
        parts[slot_topic(slot, name)] for name in ('matched_box', 'shape_prior', 'gait')
    )
    walk = read_gait(gait)
    return MatchResult(
        stamp_ns=stamp_of(box.header),
        track_id=int(box.polygon.id),
        body=read_body(box),
        placement=None,
        sequence=0,
        phase_index=0,
        phase=walk.phase,
        phase_rate=walk.rate,
        azimuth=walk.azimuth,
        similarity=walk.similarity,
        confidence=0.0,
        shape_prior=read_mono8(prior),
    )


main = partial(run_node, SegmenterNode)
"""Run the node; see :func:`run_node`."""


if __name__ == '__main__':
    sys.exit(main())
