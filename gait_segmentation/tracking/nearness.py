# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far pixels lie from the outline of a mask, where that matters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.images import Window, bounding_box

__all__ = ['REACH', 'Nearness', 'by_distance', 'nearness']

REACH = 0.12
"""How far outside of a mask distances are told, in body heights: no cue reaches farther."""

_UNIT = 1 << 16
_STRAIGHT, _DIAGONAL = round(0.955 * _UNIT), round(1.3693 * _UNIT)
"""Lengths of steps of the chamfer metric of 3 x 3 pixels (Borgefors 1986), true to about 5 %."""

_FAR = 1 << 29


@dataclass(frozen=True)
class Nearness:
    """
    Distances to the outline of a mask in pixels.

    ``part`` is the part of a window outside of which all pixels are farther than :data:`REACH`
    from the mask.  ``distance`` is (h, w) float32, positive on the mask and negative elsewhere.
    """

    part: Window
    distance: NDArray[np.float32]


def nearness(mask: NDArray[np.uint8], height: float) -> Nearness | None:
    """
    Return how near pixels are to a mask, None if it is empty.

    :param mask: (h, w) uint8, above 127 inside.
    :param height: of the body in pixels.
    """
    left, top, across, down = bounding_box(mask)
    if across == 0:
        return None
    margin = math.ceil(REACH * height) + 1
    part = (
        slice(max(top - margin, 0), min(top + down + margin, mask.shape[0])),
        slice(max(left - margin, 0), min(left + across + margin, mask.shape[1])),
    )
    inside = np.ascontiguousarray(mask[part])
    distance = np.empty(inside.shape, np.float32)
    _measure(inside, distance)
    return Nearness(part, distance)


def by_distance(
    near: Nearness | None, shape: tuple[int, ...], slope: float, low: float, high: float
) -> NDArray[np.float32]:
    """
    Return the distance to an outline times a slope, within limits, (h, w) float32.

    :param near: how near the pixels of a window are, None if all are far; where that is not
        known they are so far outside that it is the lower limit.
    :param shape: (h, w) of the window.
    """
    out = np.full(shape, low, np.float32)
    if near is not None:
        rows, columns = near.part
        _limit(near.distance, rows.start, columns.start, slope, low, high, out)
    return out


@njit(cache=True, nogil=True, fastmath=True)
def _limit(
    distance: NDArray[np.float32],
    top: int,
    left: int,
    slope: float,
    low: float,
    high: float,
    out: NDArray[np.float32],
) -> None:
    """Fill in a distance times a slope, within limits, from a row and a column on."""
    rise, least, most = np.float32(slope), np.float32(low), np.float32(high)
    for row in range(distance.shape[0]):
        here = distance[row]
        result = out[top + row, left : left + here.size]
        for col in range(here.size):
            result[col] = min(max(rise * here[col], least), most)


@njit(nogil=True)
def _padded(line: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    """Fill in a row that goes on for a pixel at both sides."""
    out[1:-1] = line
    out[0], out[-1] = line[0], line[-1]


@njit(cache=True, nogil=True)
def _begin(mask: NDArray[np.uint8], out: NDArray[np.int32]) -> None:
    """
    Fill in the lengths of single steps to pixels of the other kind, far where there is none.

    :param out: with a column more at both sides, which is far.
    """
    height, width = mask.shape
    straight, diagonal, far = np.int32(_STRAIGHT), np.int32(_DIAGONAL), np.int32(_FAR)
    out[:, 0] = far
    out[:, width + 1] = far
    rows = np.empty((3, width + 2), np.uint8)
    _padded(mask[0], rows[0])
    rows[2] = rows[0]
    for row in range(height):
        above, here, below = rows[(row - 1) % 3], rows[row % 3], rows[(row + 1) % 3]
        _padded(mask[min(row + 1, height - 1)], below)
        result = out[row]
        for col in range(width):
            own = here[col + 1]
            beside = (own ^ here[col]) | (own ^ here[col + 2])
            beside |= (own ^ above[col + 1]) | (own ^ below[col + 1])
            aslant = (own ^ above[col]) | (own ^ above[col + 2])
            aslant |= (own ^ below[col]) | (own ^ below[col + 2])
            result[col + 1] = straight if beside > 127 else diagonal if aslant > 127 else far


@njit(nogil=True)
def _sweep(lengths: NDArray[np.int32], turn: bool) -> None:
    """Hand lengths on to the next pixels and rows, there or back."""
    straight, diagonal = np.int32(_STRAIGHT), np.int32(_DIAGONAL)
    height, columns = lengths.shape[0], lengths.shape[1] - 1
    for step in range(height):
        row = height - 1 - step if turn else step
        here = lengths[row]
        if step > 0:
            last = lengths[row + 1 if turn else row - 1]
            for col in range(1, columns):
                length = min(min(last[col - 1], last[col + 1]) + diagonal, last[col] + straight)
                here[col] = min(here[col], length)
        length = np.int32(_FAR)
        if turn:
            for col in range(columns - 1, 0, -1):
                length = min(length + straight, here[col])
                here[col] = length
        else:
            for col in range(1, columns):
                length = min(length + straight, here[col])
                here[col] = length


@njit(cache=True, nogil=True)
def _measure(mask: NDArray[np.uint8], out: NDArray[np.float32]) -> None:
    """
    Fill in the distance of each pixel to the nearest of the other kind, negative outside.

    Both kinds at once: what would come to a pixel through the other kind is farther than that.
    """
    height, width = mask.shape
    lengths = np.empty((height, width + 2), np.int32)
    _begin(mask, lengths)
    _sweep(lengths, False)
    _sweep(lengths, True)
    scale = np.float32(1 / _UNIT)
    for row in range(height):
        line, here, result = mask[row], lengths[row], out[row]
        for col in range(width):
            length = scale * np.float32(here[col + 1])
            result[col] = length if line[col] > 127 else -length
