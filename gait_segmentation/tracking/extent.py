# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a mask reaches."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.images import Bounds, bounding_box

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


def extent_of(
    mask: NDArray[np.uint8],
    center: tuple[float, float],
    angle: float,
    bounds: Bounds | None = None,
) -> Extent:
    """
    Measure how far a mask reaches from a point, along and across a body of that tilt.

    :param bounds: of the mask, if they are known.
    """
    at_bottom = bool(mask[-2:].any())
    if angle:
        rows, columns = np.nonzero(mask)
        x, y = columns + 0.5 - center[0], rows + 0.5 - center[1]
        cos, sin = math.cos(angle), math.sin(angle)
        top, bottom = np.quantile(cos * y - sin * x, (0.005, 0.995))
        left, axis, right = np.quantile(cos * x + sin * y, (0.005, 0.5, 0.995))
        return Extent(top - 0.5, bottom + 0.5, left - 0.5, right + 0.5, axis, at_bottom)
    first, upper, width, height = bounding_box(mask) if bounds is None else bounds
    part = mask[upper : upper + height, first : first + width]
    top, bottom, left, axis, right = _upright(part, 0.005)
    center = (center[0] - first, center[1] - upper)
    return Extent(
        top - center[1],
        bottom + 1 - center[1],
        left - center[0],
        right + 1 - center[0],
        axis + 0.5 - center[0],
        at_bottom,
    )


@njit(cache=True, nogil=True)
def _upright(mask: NDArray[np.uint8], share: float) -> tuple[float, float, float, float, float]:
    """Return the first and last row, and the first, middle and last column, but for a share."""
    by_row = np.zeros(mask.shape[0], np.int64)
    by_column = np.zeros(mask.shape[1], np.int64)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            inside = np.int64(mask[row, col] != 0)
            by_row[row] += inside
            by_column[col] += inside
    total = by_row.sum()
    return (
        _place(by_row, share * total),
        _place(by_row, (1 - share) * total),
        _place(by_column, share * total),
        _place(by_column, 0.5 * total),
        _place(by_column, (1 - share) * total),
    )


@njit(nogil=True)
def _place(counts: NDArray[np.int64], least: float) -> float:
    """Return the first place up to which counts add up to at least that many."""
    total = 0
    for place in range(counts.size):
        total += counts[place]
        if total >= least:
            return float(place)
    return float(counts.size)
