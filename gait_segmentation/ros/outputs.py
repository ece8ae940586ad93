# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The publishers of the three stages, shared by their nodes and the pipeline's.

A message that nobody has subscribed to is not made: of a frame's it would take a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, JointState, RegionOfInterest

from gait_segmentation.ros.endpoints import LATCHED
from gait_segmentation.ros.fields import (
    matched_corners,
    refined_corners,
    slot_topic,
    track_corners,
)
from gait_segmentation.ros.messages import (
    box_message,
    compressed_message,
    gait_message,
    image_message,
)
from gait_segmentation.ros.vision import detection_types, detections_message

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.results import MatchResult, TrackResult
    from gait_segmentation.ros.lifecycle import GaitNode
    from gait_segmentation.segmentation import PeopleMasks

__all__ = ['DebugOutput', 'MatchOutputs', 'SegmentationOutputs', 'TrackOutputs']

Shape = tuple[int, int]


class DebugOutput:
    """A picture for people, only made while somebody listens."""

    def __init__(self, node: GaitNode) -> None:
        """Make the publisher."""
        self._image = node.output(Image, 'debug_image')
        self._compressed = node.output(CompressedImage, 'debug_image/compressed')

    @property
    def wanted(self) -> bool:
        """Return whether somebody listens."""
        heard = self._image.get_subscription_count() or self._compressed.get_subscription_count()
        return bool(heard)

    def publish(self, image: NDArray[np.uint8], header: Header) -> None:
        """Publish a (H, W, 3) uint8 BGR image."""
        if self._image.get_subscription_count():
            self._image.publish(image_message(image, header))
        if self._compressed.get_subscription_count():
            self._compressed.publish(compressed_message(image, header))

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish a black image."""
        if self.wanted:
            self.publish(np.zeros((*shape, 3), np.uint8), header)


class _Outputs:
    """Publishers by topic, and what they have in common."""

    def __init__(self, node: GaitNode) -> None:
        self._node = node
        self._kinds: dict[str, Any] = {}
        self._publishers: dict[str, Any] = {}

    def _make(self, kind: Any, *topics: str) -> None:
        for topic in topics:
            self._kinds[topic], self._publishers[topic] = kind, self._node.output(kind, topic)

    def _heard(self, topic: str) -> bool:
        return bool(self._publishers[topic].get_subscription_count())

    def _publish(self, topic: str, make: Callable[..., Any], *about: Any) -> None:
        """Make a message and publish it, unless nobody has subscribed."""
        if self._heard(topic):
            self._publishers[topic].publish(make(*about))

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish that nobody is seen; ``shape`` is that of the images, which are one message."""
        images: dict[Any, Any] = {Image: image_message, CompressedImage: compressed_message}
        black: dict[Any, Any] = {}
        for topic, kind in self._kinds.items():
            if not self._heard(topic):
                continue
            if kind in images and kind not in black:
                black[kind] = images[kind](np.zeros(shape, np.uint8), header)
            self._publishers[topic].publish(black.get(kind) or kind(header=header))


class TrackOutputs(_Outputs):
    """Box and likelihood of every slot, and the size of the images they are measured in."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        super().__init__(node)
        # First, so that it is known to a matcher before the likelihoods are.
        self._size = node.output(RegionOfInterest, 'image_size', LATCHED)
        for slot in range(slots):
            self._make(PolygonInstanceStamped, slot_topic(slot, 'box'))
            self._make(Image, slot_topic(slot, 'likelihood'))
        self._types = detection_types()
        if self._types is not None:
            self._make(self._types.Detection2DArray, 'tracks')
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
        if self._types is not None:
            self._publish('tracks', detections_message, tracks, header, self._types)


class MatchOutputs(_Outputs):
    """Matched box, refined box, shape prior and gait of every slot."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        super().__init__(node)
        for slot in range(slots):
            self._make(PolygonInstanceStamped, slot_topic(slot, 'matched_box'))
            self._make(PolygonInstanceStamped, slot_topic(slot, 'refined_box'))
            self._make(JointState, slot_topic(slot, 'gait'))
            self._make(Image, slot_topic(slot, 'shape_prior'))

    def publish(self, matches: Sequence[MatchResult], header: Header) -> None:
        """Publish the results of a frame."""
        for slot, match in enumerate(matches):
            for name, corners in (
                ('matched_box', matched_corners),
                ('refined_box', refined_corners),
            ):
                box = corners(match), match.track_id, header
                self._publish(slot_topic(slot, name), box_message, *box)
            self._publish(slot_topic(slot, 'gait'), gait_message, match, header)
            self._publish(
                slot_topic(slot, 'shape_prior'), image_message, match.shape_prior, header
            )


class SegmentationOutputs(_Outputs):
    """The mask of every slot, and all of them in one image."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        super().__init__(node)
        self._make(Image, 'mask', *(slot_topic(slot, 'mask') for slot in range(slots)), 'labels')
        self._make(CompressedImage, 'mask/compressed')

    def publish(self, masks: PeopleMasks, header: Header) -> None:
        """Publish the results of a frame."""
        # First what most listen to.
        self._publish('mask', image_message, masks.mask, header)
        for slot, person in enumerate(masks.people):
            self._publish(slot_topic(slot, 'mask'), image_message, person.mask, header)
        self._publish('labels', image_message, masks.labels, header)
        self._publish('mask/compressed', compressed_message, masks.mask, header)
