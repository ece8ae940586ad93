# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The publishers of the three stages, shared by their nodes and the pipeline's.

A message that nobody has subscribed to is not made: of a frame's it would take a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import Image, JointState, RegionOfInterest

from gait_segmentation.ros.fields import matched_corners, track_corners
from gait_segmentation.ros.image import image_message
from gait_segmentation.ros.messages import box_message, gait_message
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.ros.topics import slot_topic
from gait_segmentation.ros.vision import detection_types, detections_message

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.gait_model import TemplateBank
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

    @property
    def wanted(self) -> bool:
        """Return whether somebody listens."""
        return bool(self._image.get_subscription_count())

    def publish(self, image: NDArray[np.uint8], header: Header) -> None:
        """Publish a (H, W, 3) uint8 BGR image."""
        self._image.publish(image_message(image, header))

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish a black image."""
        if self.wanted:
            self.publish(np.zeros((*shape, 3), np.uint8), header)


class TrackOutputs:
    """Box and likelihood of every slot, and the size of the images they are measured in."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        # First, so that it is known to a matcher before the likelihoods are.
        self._size = node.output(RegionOfInterest, 'image_size', LATCHED)
        self._slots = [
            (
                node.output(PolygonInstanceStamped, slot_topic(slot, 'box')),
                node.output(Image, slot_topic(slot, 'likelihood')),
            )
            for slot in range(slots)
        ]
        self._types = types = detection_types()
        self._tracks = None if types is None else node.output(types.Detection2DArray, 'tracks')
        self._shape: Shape | None = None
        self.likelihood_shape: Shape = (0, 0)

    def publish(self, tracks: Sequence[TrackResult], shape: Shape, header: Header) -> None:
        """Publish the results of a frame; ``shape`` is that of the source image."""
        if shape != self._shape:
            self._shape = shape
            self._size.publish(RegionOfInterest(height=shape[0], width=shape[1]))
        for (boxes, likelihoods), track in zip(self._slots, tracks, strict=True):
            self.likelihood_shape = (track.likelihood.shape[0], track.likelihood.shape[1])
            _publish(boxes, _track_box, track, header)
            _publish(likelihoods, image_message, track.likelihood, header)
        self._publish_detections(tracks, header)

    def blank(self, header: Header) -> None:
        """Publish that nobody is seen."""
        for boxes, _ in self._slots:
            _publish(boxes, box_message, (), 0, header)
        _publish_black((each for _, each in self._slots), self.likelihood_shape, header)
        self._publish_detections((), header)

    def _publish_detections(self, tracks: Sequence[TrackResult], header: Header) -> None:
        if self._tracks is not None:
            _publish(self._tracks, detections_message, tracks, header, self._types)


class MatchOutputs:
    """Matched box, shape prior and gait of every slot."""

    def __init__(self, node: GaitNode, bank: TemplateBank, slots: int) -> None:
        """Make the publishers."""
        self._bank = bank
        self._slots = [
            (
                node.output(PolygonInstanceStamped, slot_topic(slot, 'matched_box')),
                node.output(Image, slot_topic(slot, 'shape_prior')),
                node.output(JointState, slot_topic(slot, 'gait')),
            )
            for slot in range(slots)
        ]

    def publish(self, matches: Sequence[MatchResult], header: Header) -> None:
        """Publish the results of a frame."""
        for (boxes, priors, gaits), match in zip(self._slots, matches, strict=True):
            _publish(boxes, self._box, match, header)
            _publish(gaits, gait_message, match, header)
            _publish(priors, image_message, match.shape_prior, header)

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish that nobody is seen; ``shape`` is that of the likelihood."""
        for boxes, _, gaits in self._slots:
            _publish(boxes, box_message, (), 0, header)
            _publish(gaits, lambda: JointState(header=header))
        _publish_black((each for _, each, _ in self._slots), shape, header)

    def _box(self, match: MatchResult, header: Header) -> PolygonInstanceStamped:
        return box_message(matched_corners(match, self._bank), match.track_id, header)


class SegmentationOutputs:
    """The mask of every slot, and all of them in one image."""

    def __init__(self, node: GaitNode, slots: int) -> None:
        """Make the publishers."""
        self._slots = [node.output(Image, slot_topic(slot, 'mask')) for slot in range(slots)]
        self._mask = node.output(Image, 'mask')
        self._labels = node.output(Image, 'labels')

    def publish(self, masks: PeopleMasks, header: Header) -> None:
        """Publish the results of a frame."""
        # First what most listen to.
        _publish(self._mask, image_message, masks.mask, header)
        for output, person in zip(self._slots, masks.people, strict=True):
            _publish(output, image_message, person.mask, header)
        _publish(self._labels, image_message, masks.labels, header)

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish empty masks; ``shape`` is that of the source image."""
        _publish_black((self._mask, *self._slots, self._labels), shape, header)


def _track_box(track: TrackResult, header: Header) -> PolygonInstanceStamped:
    return box_message(track_corners(track), track.track_id, header)


def _publish_black(publishers: Iterable[Any], shape: Shape, header: Header) -> None:
    """Publish one black image on all topics that somebody has subscribed to."""
    heard = [each for each in publishers if each.get_subscription_count()]
    if heard:
        black = image_message(np.zeros(shape, np.uint8), header)
        for each in heard:
            each.publish(black)


def _publish(publisher: Any, make: Callable[..., Any], *about: Any) -> None:
    """Make a message and publish it, unless nobody has subscribed."""
    if publisher.get_subscription_count():
        publisher.publish(make(*about))
