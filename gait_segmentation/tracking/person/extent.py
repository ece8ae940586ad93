# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a mask reaches."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Bounds, bounding_box, quantiles

__all__ = ['Extent', 'axis_tilt', 'extent_of']

_OUTERMOST = 0.005
"""Share of the pixels at each end that does not count."""


@dataclass(frozen=True)
class Extent:
    """
    How far a mask reaches from a point, along and across the body, in pixels.

    The outermost 0.5 % of the pixels do not count.  ``axis`` is the median across; ``at_bottom``
    tells that the mask ends at the lower border.
    """

    top: float
    bottom: float
    left: float
    right: float
    axis: float
    at_bottom: bool

    @property
    def middle(self) -> float:
        """Return the middle between top and bottom."""
        return (self.top + self.bottom) / 2


def extent_of(
    mask: NDArray[np.uint8],
    center: tuple[float, float],
    angle: float,
    bounds: Bounds | None = None,
) -> Extent:
    """
    Measure how far a mask reaches from a point, along and across a body of that tilt.

    :param mask: (h, w) uint8, not all zero.
    :param bounds: of the mask, if they are known.
    """
    first, upper, width, height = bounding_box(mask) if bounds is None else bounds
    at_bottom = height > 0 and upper + height >= mask.shape[0] - 1
    rows, columns = np.nonzero(mask[upper : upper + height, first : first + width])
    right, down = columns + (first + 0.5 - center[0]), rows + (upper + 0.5 - center[1])
    cos, sin = math.cos(angle), math.sin(angle)
    along, across = cos * down - sin * right, cos * right + sin * down
    top, bottom = quantiles(along, (_OUTERMOST, 1 - _OUTERMOST))
    left, axis, far = quantiles(across, (_OUTERMOST, 0.5, 1 - _OUTERMOST))
    return Extent(top - 0.5, bottom + 0.5, left - 0.5, far + 0.5, axis, at_bottom)


def axis_tilt(mask: NDArray[np.uint8]) -> float:
    """Return by how much the main axis of a mask leans to the right, in radians."""
    moments = cv2.moments(mask, binaryImage=True)
    return 0.5 * math.atan2(-2 * moments['mu11'], moments['mu02'] - moments['mu20'])
