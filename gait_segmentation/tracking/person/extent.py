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
from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.nearness import Nearness

__all__ = ['Extent', 'axis_tilt', 'extent_of', 'likely_extent']

_STEPS = 8
"""Parts of a pixel in which places on tilted bodies are counted."""

_OUTERMOST = 0.005
"""Share of the pixels at each end that does not count."""


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
    first, upper, width, height = bounding_box(mask) if bounds is None else bounds
    at_bottom = height > 0 and upper + height >= mask.shape[0] - 1
    part = np.ascontiguousarray(mask[upper : upper + height, first : first + width])
    if angle:
        x, y = center[0] - first, center[1] - upper
        top, bottom, left, axis, right = _tilted(
            part, x, y, math.cos(angle), math.sin(angle), _OUTERMOST
        )
        return Extent(top - 0.5, bottom + 0.5, left - 0.5, right + 0.5, axis, at_bottom)
    _, top, bottom, left, axis, right = _upright(part, _OUTERMOST)
    center = (center[0] - first, center[1] - upper)
    return Extent(
        top - center[1],
        bottom + 1 - center[1],
        left - center[0],
        right + 1 - center[0],
        axis + 0.5 - center[0],
        at_bottom,
    )


def likely_extent(
    values: NDArray[np.uint8], near: Nearness, reach: float, center: tuple[float, float]
) -> tuple[int, Extent]:
    """
    Measure how far likely pixels near a mask reach from a point, upright.

    :param values: (h, w) uint8 likelihood of a window.
    :param near: how near its pixels are to the mask.
    :param reach: how far from the mask pixels count, in pixels.
    :param center: (x, y) in the window.
    :returns: how many pixels there are, and the extent, which says nothing if there are none.
    """
    part = np.ascontiguousarray(values[near.part])
    count, top, bottom, left, axis, right = _likely(part, near.distance, -reach, _OUTERMOST)
    x, y = center[0] - near.part[1].start, center[1] - near.part[0].start
    at_bottom = near.part[0].start + bottom >= values.shape[0] - 2
    return count, Extent(
        top - y, bottom + 1 - y, left - x, right + 1 - x, axis + 0.5 - x, at_bottom
    )


def axis_tilt(mask: NDArray[np.uint8]) -> float:
    """Return by how much the main axis of a mask leans to the right, in radians."""
    return float(_tilt(np.ascontiguousarray(mask)))


@kernel('u1[:,::1]')
def _tilt(mask: NDArray[np.uint8]) -> float:
    # Exact sums of ones, of places, and of their products.
    ones, across, down = 0, 0, 0
    squared_across, squared_down, product = 0, 0, 0
    for row in range(mask.shape[0]):
        line, count, sums, squares = mask[row], 0, 0, 0
        for col in range(line.size):
            inside = np.int64(line[col] != 0)
            place = col * inside
            count += inside
            sums += place
            squares += place * place
        ones += count
        across += sums
        down += row * count
        squared_across += squares
        squared_down += row * row * count
        product += row * sums
    if ones == 0:
        return 0.0
    spread = (squared_down - down * down / ones) - (squared_across - across * across / ones)
    return 0.5 * math.atan2(-2 * (product - across * down / ones), spread)


@kernel('u1[:,::1], f8, f8, f8, f8, f8')
def _tilted(
    mask: NDArray[np.uint8], x: float, y: float, cos: float, sin: float, share: float
) -> tuple[float, float, float, float, float]:
    """
    Return how far pixels reach from a point along a tilted body and across, but for a share.

    That is from the top to the bottom, and to the left, the middle and the right; to a sixteenth
    of a pixel, since places are counted in steps.
    """
    height, width = mask.shape
    reach = height + width + 2
    along, across = np.zeros(2 * reach * _STEPS, np.int32), np.zeros(2 * reach * _STEPS, np.int32)
    # Counted from the middle of the mask, from where nothing is far.
    middle_x, middle_y = width / 2, height / 2
    for row in range(height):
        down = row + 0.5 - middle_y
        for col in range(width):
            if mask[row, col] != 0:
                right = col + 0.5 - middle_x
                along[int((cos * down - sin * right + reach) * _STEPS)] += 1
                across[int((cos * right + sin * down + reach) * _STEPS)] += 1
    _, top, bottom, left, axis, right_end = _places(along, across, share)
    off_x, off_y = middle_x - x, middle_y - y
    start_along = cos * off_y - sin * off_x - reach + 0.5 / _STEPS
    start_across = cos * off_x + sin * off_y - reach + 0.5 / _STEPS
    return (
        top / _STEPS + start_along,
        bottom / _STEPS + start_along,
        left / _STEPS + start_across,
        axis / _STEPS + start_across,
        right_end / _STEPS + start_across,
    )


@kernel('u1[:,::1], f8')
def _upright(
    mask: NDArray[np.uint8], share: float
) -> tuple[int, float, float, float, float, float]:
    """
    Return the number of pixels and how far they reach, but for a share.

    That is the first and the last row, and the first, the middle and the last column.
    """
    by_row = np.zeros(mask.shape[0], np.int32)
    by_column = np.zeros(mask.shape[1], np.int32)
    for row in range(mask.shape[0]):
        line, count = mask[row], np.int32(0)
        for col in range(line.size):
            inside = np.int32(line[col] != 0)
            count += inside
            by_column[col] += inside
        by_row[row] = count
    return _places(by_row, by_column, share)


@kernel('u1[:,::1], f4[:,::1], f8, f8')
def _likely(
    values: NDArray[np.uint8], distance: NDArray[np.float32], least: float, share: float
) -> tuple[int, float, float, float, float, float]:
    """Do the same for the likely pixels that are near: their distance is at least so much."""
    low = np.float32(least)
    by_row = np.zeros(values.shape[0], np.int32)
    by_column = np.zeros(values.shape[1], np.int32)
    for row in range(values.shape[0]):
        line, far, count = values[row], distance[row], np.int32(0)
        for col in range(line.size):
            inside = np.int32(line[col] > 127) & np.int32(far[col] >= low)
            count += inside
            by_column[col] += inside
        by_row[row] = count
    return _places(by_row, by_column, share)


@njit(nogil=True)
def _places(
    by_row: NDArray[np.int32], by_column: NDArray[np.int32], share: float
) -> tuple[int, float, float, float, float, float]:
    total = int(by_row.sum())
    return (
        total,
        _place(by_row, share * total),
        _place(by_row, (1 - share) * total),
        _place(by_column, share * total),
        _place(by_column, 0.5 * total),
        _place(by_column, (1 - share) * total),
    )


@njit(nogil=True)
def _place(counts: NDArray[np.int32], least: float) -> float:
    """Return the first place up to which counts add up to at least that many."""
    total = 0
    for place in range(counts.size):
        total += counts[place]
        if total >= least:
            return float(place)
    return float(counts.size)
