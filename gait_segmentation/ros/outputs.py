# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The publishers of the three stages, shared by their nodes and the pipeline's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import Image, JointState, RegionOfInterest

from gait_segmentation.drawing import draw_box, draw_label, draw_outline, draw_person, track_colour
from gait_segmentation.ros.image import image_message
from gait_segmentation.ros.messages import box_message, gait_message, tracked_corners
from gait_segmentation.ros.qos import LATCHED

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.gait_model import TemplateBank
    from gait_segmentation.geometry import Box
    from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
    from gait_segmentation.ros.lifecycle import GaitNode

__all__ = ['SLOT', 'DebugOutput', 'MatchOutputs', 'SegmentationOutputs', 'TrackOutputs']

SLOT = 'person_0'
"""Prefix of the topics of the one person that is tracked at a time."""

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
    """Box and likelihood of a person, and the size of the images they are measured in."""

    def __init__(self, node: GaitNode) -> None:
        """Make the publishers."""
        # First, so that it is known to a matcher before the likelihoods are.
        self._size = node.output(RegionOfInterest, 'image_size', LATCHED)
        self._box = node.output(PolygonInstanceStamped, f'{SLOT}/box')
        self._likelihood = node.output(Image, f'{SLOT}/likelihood')
        self._shape: Shape | None = None
        self.likelihood_shape: Shape = (0, 0)

    def publish(self, track: TrackResult, shape: Shape, header: Header) -> None:
        """Publish a result; ``shape`` is that of the source image."""
        if shape != self._shape:
            self._shape = shape
            self._size.publish(RegionOfInterest(height=shape[0], width=shape[1]))
        self.likelihood_shape = (track.likelihood.shape[0], track.likelihood.shape[1])
        corners = () if track.box is None else tracked_corners(track.box, track.angle)
        self._box.publish(box_message(corners, track.track_id, header))
        self._likelihood.publish(image_message(track.likelihood, header))

    def blank(self, header: Header) -> None:
        """Publish that nobody is seen."""
        self._box.publish(box_message((), 0, header))
        black = np.zeros(self.likelihood_shape, np.uint8)
        self._likelihood.publish(image_message(black, header))


class MatchOutputs:
    """Matched box, shape prior and gait of a person."""

    def __init__(self, node: GaitNode, bank: TemplateBank) -> None:
        """Make the publishers."""
        self._bank = bank
        self._box = node.output(PolygonInstanceStamped, f'{SLOT}/matched_box')
        self._prior = node.output(Image, f'{SLOT}/shape_prior')
        self._gait = node.output(JointState, f'{SLOT}/gait')

    def publish(self, match: MatchResult, header: Header) -> None:
        """Publish a result."""
        corners: tuple[tuple[float, float], ...] = ()
        if match.body is not None:
            corners = match.body.corners(match.body.height * self._width(match))
        self._box.publish(box_message(corners, match.track_id, header))
        self._gait.publish(gait_message(match, header))
        self._prior.publish(image_message(match.shape_prior, header))

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish that nobody is seen; ``shape`` is that of the likelihood."""
        self._box.publish(box_message((), 0, header))
        self._gait.publish(JointState(header=header))
        self._prior.publish(image_message(np.zeros(shape, np.uint8), header))

    def _width(self, match: MatchResult) -> float:
        """Return the width of the matched template about the body's axis, in body heights."""
        template = self._bank.templates[match.sequence, match.phase_index]
        rows, columns = template.shape
        inside = np.flatnonzero((template > 127).any(axis=0))
        if not inside.size:
            return 1.0
        half = max(columns / 2 - inside[0], inside[-1] + 1 - columns / 2)
        return float(2 * half / (rows * self._bank.fill))


class SegmentationOutputs:
    """The masks."""

    def __init__(self, node: GaitNode) -> None:
        """Make the publishers."""
        self._person = node.output(Image, f'{SLOT}/mask')
        self._mask = node.output(Image, 'mask')
        self._labels = node.output(Image, 'labels')

    def publish(self, result: SegmentationResult, header: Header) -> None:
        """Publish a result."""
        self._publish(result.mask, header)

    def blank(self, shape: Shape, header: Header) -> None:
        """Publish empty masks; ``shape`` is that of the source image."""
        self._publish(np.zeros(shape, np.uint8), header)

    def _publish(self, mask: NDArray[np.uint8], header: Header) -> None:
        message = image_message(mask, header)
        self._person.publish(message)
        self._mask.publish(message)
        self._labels.publish(image_message(mask & np.uint8(1), header))


def tracking_picture(image: NDArray[np.uint8], track: TrackResult) -> NDArray[np.uint8]:
    """Return a frame with the likelihood in red and the box."""
    picture = image.copy()
    size = (image.shape[1], image.shape[0])
    red = cv2.resize(track.likelihood, size, interpolation=cv2.INTER_LINEAR)
    picture[:, :, 2] = np.maximum(picture[:, :, 2], red)
    if track.box is not None:
        colour = track_colour(track.track_id)
        draw_box(picture, track.box, colour)
        words = f'{track.track_id}  {100 * track.confidence:.0f} %'
        draw_label(picture, words, (track.box.x, track.box.y - 16), colour)
    return picture


def matching_picture(likelihood: NDArray[np.uint8], match: MatchResult) -> NDArray[np.uint8]:
    """Return a likelihood with the outline of the matched template."""
    picture = np.asarray(cv2.cvtColor(likelihood, cv2.COLOR_GRAY2BGR))
    draw_outline(picture, match.shape_prior, track_colour(match.track_id))
    return picture


def segmentation_picture(
    image: NDArray[np.uint8], mask: NDArray[np.uint8], box: Box | None, match: MatchResult
) -> NDArray[np.uint8]:
    """Return a frame with silhouette, box and gait."""
    picture = image.copy()
    if box is not None:
        draw_person(
            picture,
            mask=mask,
            box=box,
            track_id=match.track_id,
            phase=match.phase,
            azimuth=match.azimuth,
        )
    return picture
