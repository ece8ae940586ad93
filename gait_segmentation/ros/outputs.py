# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the stages publish, shared by their nodes and the pipeline's.

A message that nobody has subscribed to is not made: of a frame's it would take a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped, PoseWithCovarianceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, JointState, RegionOfInterest
from visualization_msgs.msg import ImageMarker, MarkerArray

from gait_segmentation.geometry import Box
from gait_segmentation.ros.endpoints import LATCHED
from gait_segmentation.ros.messages import (
    box_message,
    compressed_message,
    gait_message,
    image_message,
)
from gait_segmentation.ros.people_messages import (
    Person,
    boxes_message,
    detection_types,
    markers_message,
    people_message,
    pose_message,
    solid_people_message,
    tracks_message,
    walk_message,
)
from gait_segmentation.streams.fields import (
    matched_corners,
    refined_corners,
    slot_topic,
    slot_topics,
    track_corners,
)

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.localization import Location
    from gait_segmentation.results import MatchResult, TrackResult
    from gait_segmentation.ros.lifecycle import GaitNode
    from gait_segmentation.segmentation import PeopleMasks

__all__ = ['DebugOutput', 'MatchOutputs', 'PeopleOutputs', 'SegmentationOutputs', 'TrackOutputs']

Shape = tuple[int, int]

_IMAGES: dict[Any, Callable[..., Any]] = {
    Image: image_message,
    CompressedImage: compressed_message,
}


class _Outputs:
    """Publishers by topic, of which those are served that are listened to."""

    def __init__(self, node: GaitNode, kinds: dict[str, Any]) -> None:
        """Make the publishers; ``kinds`` are the types of the messages by topic."""
        self._kinds = kinds
        self._publishers = {topic: node.output(kind, topic) for topic, kind in kinds.items()}

    def _heard(self, topic: str) -> bool:
        return topic in self._publishers and self._publishers[topic].get_subscription_count() > 0

    def _publish(self, topic: str, make: Callable[..., Any], *about: Any) -> None:
        """Make a message and publish it, unless nobody listens."""
        if self._heard(topic):
            self._publishers[topic].publish(make(*about))

    def blank(self, shape: tuple[int, ...], header: Header) -> None:
        """Publish that nobody is seen; ``shape`` is that of the images, which are one message."""
        black: dict[Any, Any] = {}
        for topic, kind in self._kinds.items():
            if not self._heard(topic):
                continue
            if kind in _IMAGES and kind not in black:
                black[kind] = _IMAGES[kind](np.zeros(shape, np.uint8), header)
            self._publishers[topic].publish(black.get(kind) or kind(header=header))


class DebugOutput(_Outputs):
    """A picture for people."""

    def __init__(self, node: GaitNode) -> None:
        """Make the publishers."""
        super().__init__(node, {'debug_image': Image, 'debug_image/compressed': CompressedImage})

    def publish(self, header: Header, draw: Callable[..., NDArray[np.uint8]], *about: Any) -> None:
        """Draw a (H, W, 3) uint8 BGR image and publish it, unless nobody listens."""
        heard = {topic: kind for topic, kind in self._kinds.items() if self._heard(topic)}
        picture = draw(*about) if heard else None
        for topic, kind in heard.items():
            self._publishers[topic].publish(_IMAGES[kind](picture, header))

    def blank(self, shape: tuple[int, ...], header: Header) -> None:
        """Publish a black image of a shape (height, width)."""
        super().blank((*shape, 3), header)


class TrackOutputs(_Outputs):
    """Box and likelihood of every slot, and the size of the images they are measured in."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        # First, so that it is known to a matcher before the likelihoods are.
        self._size = node.output(RegionOfInterest, 'image_size', LATCHED)
        kinds = slot_topics({'box': PolygonInstanceStamped, 'likelihood': Image}, slots)
        self._types = detection_types()
        if self._types is not None:
            kinds['tracks'] = self._types.Detection2DArray
        super().__init__(node, kinds)
        self._shape: Shape | None = None
        self.likelihood_shape: Shape = (0, 0)

    def publish(self, tracks: Sequence[TrackResult], shape: Shape, header: Header) -> None:
        """Publish the results of a frame; ``shape`` is that of the source image."""
        if shape != self._shape:
            self._shape = shape
            self._size.publish(RegionOfInterest(height=shape[0], width=shape[1]))
        for slot, track in enumerate(tracks):
            self.likelihood_shape = (track.likelihood.shape[0], track.likelihood.shape[1])
            box = track_corners(track), track.track_id, header
            self._publish(slot_topic(slot, 'box'), box_message, *box)
            self._publish(slot_topic(slot, 'likelihood'), image_message, track.likelihood, header)
        self._publish('tracks', tracks_message, tracks, header, self._types)


class MatchOutputs(_Outputs):
    """Matched box, refined box, shape prior and gait of every slot."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        kinds = {
            'matched_box': PolygonInstanceStamped,
            'refined_box': PolygonInstanceStamped,
            'gait': JointState,
            'shape_prior': Image,
        }
        super().__init__(node, slot_topics(kinds, slots))

    def publish(self, matches: Sequence[MatchResult], header: Header) -> None:
        """Publish the results of a frame."""
        for slot, match in enumerate(matches):
            publish = partial(self._publish_of, slot)
            publish('matched_box', box_message, matched_corners(match), match.track_id, header)
            publish('refined_box', box_message, refined_corners(match), match.track_id, header)
            publish('gait', gait_message, match, header)
            publish('shape_prior', image_message, match.shape_prior, header)

    def _publish_of(self, slot: int, name: str, *about: Any) -> None:
        self._publish(slot_topic(slot, name), *about)


class SegmentationOutputs(_Outputs):
    """The mask of every slot, and all of them in one image."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        topics = ('mask', *slot_topics({'mask': Image}, slots), 'labels')
        super().__init__(
            node, {**dict.fromkeys(topics, Image), 'mask/compressed': CompressedImage}
        )

    def publish(self, masks: PeopleMasks, header: Header) -> None:
        """Publish the results of a frame."""
        # First what most listen to.
        self._publish('mask', image_message, masks.mask, header)
        for slot, person in enumerate(masks.people):
            self._publish(slot_topic(slot, 'mask'), image_message, person.mask, header)
        self._publish('labels', image_message, masks.labels, header)
        self._publish('mask/compressed', compressed_message, masks.mask, header)


class PeopleOutputs(_Outputs):
    """Everybody in one message, and where each one is and how they walk."""

    def __init__(self, node: GaitNode, slots: int, located: bool) -> None:
        """Make the publishers; ``located``: whether it will be known where people are."""
        self._types = detection_types()
        kinds: dict[str, Any] = {'boxes': ImageMarker}
        if self._types is not None:
            kinds['people'] = self._types.Detection2DArray
        if located:
            kinds['markers'] = MarkerArray
            kinds |= slot_topics({'pose': PoseWithCovarianceStamped, 'walk': JointState}, slots)
            if self._types is not None:
                kinds['people_3d'] = self._types.Detection3DArray
        super().__init__(node, kinds)

    def publish(
        self,
        matches: Sequence[MatchResult],
        masks: Sequence[NDArray[np.uint8]],
        locations: Sequence[Location | None],
        header: Header,
    ) -> None:
        """Publish what is known of a frame, one a slot; nothing of nobody's pose."""
        if not any(map(self._heard, self._publishers)):
            return
        for slot, location in enumerate(locations):
            if location is not None:
                self._publish(slot_topic(slot, 'pose'), pose_message, location, header)
                self._publish(slot_topic(slot, 'walk'), walk_message, location, header)
        people = []
        for slot, (match, mask) in enumerate(zip(matches, masks, strict=True)):
            box = Box.around(mask) if match.body is not None else None
            if box is not None:
                people.append(Person(match, box, locations[slot] if locations else None))
        self._publish('boxes', boxes_message, people, header)
        self._publish('markers', markers_message, people, header)
        self._publish('people', people_message, people, header, self._types)
        self._publish('people_3d', solid_people_message, people, header, self._types)
