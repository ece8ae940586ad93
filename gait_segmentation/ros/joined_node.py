# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all nodes do with their inputs: they join them on the exact stamp of a frame."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, ClassVar

from sensor_msgs.msg import Image

from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.advice import no_images, nothing_from, unpublished
from gait_segmentation.ros.endpoints import CameraSubscription
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import read_body, read_gait, stamp_of
from gait_segmentation.streams.config import CameraConfig
from gait_segmentation.streams.fields import DEPTH, slot_topic, slot_topics
from gait_segmentation.streams.join import ExactJoin

__all__ = ['JoinedNode', 'Parts', 'read_match']

Parts = dict[str, Any]
"""The messages about a frame by topic."""


class JoinedNode(GaitNode):
    """
    A node that works on frames of which all messages have come.

    Derived classes declare :attr:`kinds`; their :meth:`process` gets :data:`Parts`.  The images
    of the camera are among them if there is a :class:`CameraConfig`.
    """

    kinds: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """Types of messages by topic of a slot, by the node they come from, in the order of work."""

    room_remedy: ClassVar[str] = ''
    """What gives more :meth:`room`, if anything does."""

    camera: CameraSubscription | None = None
    camera_topic = 'image'
    """Not yet remapped."""

    @property
    def slots(self) -> int:
        """Return how many people there may be."""
        return self.parameters.get(PeopleConfig).max_people

    def room(self) -> int:
        """Return how many frames may wait for their other parts."""
        return DEPTH

    def joined(self, stamp_ns: int, parts: Parts) -> None:
        """Take in a frame of which all parts have come."""
        self.hand_over(stamp_ns, parts)

    def connect(self) -> None:
        """Subscribe to the outputs of the other nodes, and to the camera."""
        self._topics = {node: slot_topics(each, self.slots) for node, each in self.kinds.items()}
        camera = {'camera': ['image']} if self.has(CameraConfig) else {}
        self._join = ExactJoin({**camera, **self._topics}, self.room())
        for topics in self._topics.values():
            for topic, kind in topics.items():
                self.input(kind, topic, partial(self._part, topic))
        if camera:
            self.camera_input(self.parameters.get(CameraConfig), partial(self._part, 'image'))

    def camera_input(
        self,
        config: CameraConfig,
        received: Callable[[Any], None],
        topic: str = 'image',
        kind: Any = Image,
    ) -> None:
        """Subscribe to images of a camera, or what else it says, until the deactivation."""
        made = CameraSubscription(self, config, received, topic, kind)
        self.keep_input(made.close)
        if topic == 'image':
            self.camera, self.camera_topic = made, made.topic

    def missing(self) -> str:
        """Say whether it is the camera or another node that does not publish."""
        sees = self.has(CameraConfig)
        if sees and not self.count_publishers(self.resolve_topic_name(self.camera_topic)):
            return no_images(self, self.camera_topic)
        absent = (unpublished(self, topics, node) for node, topics in self._topics.items())
        silent = self._join.waits_for or ('camera' if sees else next(iter(self._topics)))
        return next(filter(None, absent), '') or (
            nothing_from(silent) if silent in self._topics else no_images(self, self.camera_topic)
        )

    def status(self) -> dict[str, str]:
        """Report the camera, if there is one."""
        seen = self.has(CameraConfig)
        return {'camera': self.resolve_topic_name(self.camera_topic)} if seen else {}

    def pause(self) -> None:
        """Drop what waits for its other parts."""
        if self.state == 'active':
            self._join.forget()

    def _part(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        if not self.accept(stamp_ns):
            return
        join = self._join
        parts = join.add(part, stamp_ns, message)
        self.statistics.skipped += join.skipped.total()
        self.statistics.incomplete += join.missed.total() + join.late.total()
        self.note_again(join.again.total())
        self.warnings.warn_of_missed(join, self.room_remedy)
        for counter in (join.skipped, join.missed, join.late, join.again):
            counter.clear()
        if parts is not None:
            self.joined(stamp_ns, parts)


def read_match(parts: Parts, slot: int) -> MatchResult:
    """
    Put the matcher's messages about a slot together again.

    What no later stage needs (template, placement) is not sent; the shape prior is black if it is
    not among the parts.

    :raises InputError: if a message cannot be read.
    """
    box = parts[slot_topic(slot, 'matched_box')]
    walk = read_gait(parts[slot_topic(slot, 'gait')])
    nobody = MatchResult.nobody(stamp_of(box.header), int(box.polygon.id), (0, 0))
    prior = parts.get(slot_topic(slot, 'shape_prior'))
    return dataclasses.replace(
        nobody,
        body=read_body(box),
        phase=walk.phase,
        phase_rate=walk.rate,
        azimuth=walk.azimuth,
        similarity=walk.similarity,
        shape_prior=nobody.shape_prior if prior is None else read_mono8(prior),
    )
