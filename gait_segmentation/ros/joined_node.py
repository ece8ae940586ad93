# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all nodes do with their inputs: they join them on the exact stamp of a frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, ClassVar

from sensor_msgs.msg import Image

from gait_segmentation.people import PeopleConfig
from gait_segmentation.ros.advice import no_images, nothing_from, unpublished
from gait_segmentation.ros.camera_subscription import CameraSubscription
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.streams.config import CameraConfig
from gait_segmentation.streams.fields import DEPTH, Parts, slot_topics, stamp_of
from gait_segmentation.streams.join import ExactJoin


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

    localizing: Any = None
    """What locates people, from :meth:`build` on, if the node does."""

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
        # Images alone are complete as they are.
        stages = {**camera, **self._topics}
        self._join = ExactJoin(stages, self.room()) if self._topics else None
        for topics in self._topics.values():
            for topic, kind in topics.items():
                self.input(kind, topic, partial(self._part, topic))
        if self.localizing is not None:
            self.localizing.connect()
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
        waits_for = '' if self._join is None else self._join.waits_for
        silent = waits_for or ('camera' if sees else next(iter(self._topics)))
        return next(filter(None, absent), '') or (
            nothing_from(silent) if silent in self._topics else no_images(self, self.camera_topic)
        )

    def status(self) -> dict[str, str]:
        """Report the camera, if there is one, and who is located, if anybody is to be."""
        seen = self.has(CameraConfig)
        camera = {'camera': self.resolve_topic_name(self.camera_topic)} if seen else {}
        locates = self.localizing is not None and self.stage is not None
        return {**camera, **(self.localizing.status() if locates else {})}

    def trouble(self) -> str:
        """Say why nobody is located."""
        locates = self.localizing is not None and self.stage is not None
        return self.localizing.trouble() if locates else ''

    def pause(self) -> None:
        """Drop what waits for its other parts."""
        if self.state == 'active' and self._join is not None:
            self._join.forget()

    def _part(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        if not self.accept(stamp_ns):
            return
        join = self._join
        if join is None:
            self.joined(stamp_ns, {part: message})
            return
        parts = join.add(part, stamp_ns, message)
        self.statistics.skipped += join.skipped.total()
        self.statistics.incomplete += join.missed.total() + join.late.total()
        self.note_again(join.again.total())
        self.warnings.warn_of_missed(join, self.room_remedy)
        for counter in (join.skipped, join.missed, join.late, join.again):
            counter.clear()
        if parts is not None:
            self.joined(stamp_ns, parts)
