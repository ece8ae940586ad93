# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a mask reaches."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['Extent', 'extent_of']


@dataclass(frozen=True)
class Extent:
    """
    How far a mask reaches from a point, along and across the body, in pixels.

    The outermost 0.5 % of the pixels do not count; ``axis`` is the median across.
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


def extent_of(mask: NDArray[np.uint8], center: tuple[float, float], angle: float) -> Extent:
    """Measure how far a mask reaches from a point, along and across a body of that tilt."""
    at_bottom = bool(mask[-2:].any())
    if angle:
        rows, columns = np.nonzero(mask)
        x, y = columns + 0.5 - center[0], rows + 0.5 - center[1]
        cos, sin = math.cos(angle), math.sin(angle)
        top, bottom = np.quantile(cos * y - sin * x, (0.005, 0.995))
        left, axis, right = np.quantile(cos * x + sin * y, (0.005, 0.5, 0.995))
        return Extent(top - 0.5, bottom + 0.5, left - 0.5, right + 0.5, axis, at_bottom)
    x, y, width, height = cv2.boundingRect(mask)
    part = mask[y : y + height, x : x + width]
    by_row = np.cumsum(cv2.reduce(part, 1, cv2.REDUCE_SUM, dtype=cv2.CV_32S) // 255)
    by_column = np.cumsum(cv2.reduce(part, 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S) // 255)
    total = by_row[-1]
    center = (center[0] - x, center[1] - y)
    top, bottom = np.searchsorted(by_row, (0.005 * total, 0.995 * total))
    left, axis, right = np.searchsorted(by_column, (0.005 * total, 0.5 * total, 0.995 * total))
    return Extent(
        float(top) - center[1],
        float(bottom) + 1 - center[1],
        float(left) - center[0],
        float(right) + 1 - center[0],
        float(axis) + 0.5 - center[0],
        at_bottom,
    )
