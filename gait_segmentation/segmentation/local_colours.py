# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Which side of the outline a pixel's colour belongs to, told by the colours on both sides nearby.

A pixel on the outline is a mixture of person and background.  A background model takes it for the
person as soon as it is not the background, so outlines lie too far out.  Here the outline lies
where the mixture is even: a linear discriminant of the two colours nearby, as in alpha matting.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['add_odds', 'discriminant']

_APART_PX = 1
"""Pixels of the first cut that are left out on both sides of its outline."""

_REACH_PX = 4
"""Half width of the neighbourhood, in pixels of the first cut."""

_NOISE = 4.0
"""Standard deviation of an even colour."""

_LEAST_SHARE = 0.02
"""Least share of the neighbourhood on either side."""

_LIMIT = 3.0
"""Largest log-odds."""


def discriminant(
    image: NDArray[np.uint8], labels: NDArray[np.bool_], wanted: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """
    Return the linear discriminant of person and background about each pixel.

    :param image: (h, w, 3) uint8 in Lab, whose channels vary independently enough.
    :param labels: (h, w) bool, the cut.
    :param wanted: (h, w) bool, the pixels it is wanted for.
    :returns: (h, w, 4) float32, (a, b, c, d) of the log-odds ``a x + b y + c z - d`` of a colour
        (x, y, z); 0 where there is only one side nearby; undefined where it is not wanted.
    """
    inside = labels.view(np.uint8)
    kernel = np.ones((2 * _APART_PX + 1, 2 * _APART_PX + 1), np.uint8)
    # 0 = background, 1 = neither, 2 = person.
    side = cv2.erode(inside, kernel) + cv2.dilate(inside, kernel)
    line = np.empty((*labels.shape, 4), np.float32)
    _discriminant(image, side, wanted, line)
    return line


@njit(cache=True, nogil=True)
def _sum_row(
    image: NDArray[np.uint8],
    side: NDArray[np.uint8],
    row: int,
    col: int,
    sums: NDArray[np.int64],
) -> None:
    """
    Sum up one row of a pixel's neighbourhood, as much of it as there is.

    :param sums: (6,) int64, for background and person: values of the three channels, 21 bits
        each; squares of the first two, 32 bits each; squares of the third and the count.
    """
    values = squares = others = own_values = own_squares = own_others = 0
    if 0 <= row < side.shape[0]:
        first = max(col - _REACH_PX, 0)
        last = min(col + _REACH_PX + 1, side.shape[1])
        sides, colours = side[row, first:last], image[row, first:last]
        for k in range(len(sides)):
            one, two, three = (
                np.int64(colours[k, 0]),
                np.int64(colours[k, 1]),
                np.int64(colours[k, 2]),
            )
            # All bits where it counts, so that nothing has to be jumped over.
            is_own = -np.int64(sides[k] >> 1)
            is_other = -np.int64(sides[k] == 0)
            value = one + (two << 21) + (three << 42)
            square = one * one + ((two * two) << 32)
            other = three * three + (1 << 32)
            values += value & is_other
            squares += square & is_other
            others += other & is_other
            own_values += value & is_own
            own_squares += square & is_own
            own_others += other & is_own
    sums[0], sums[1], sums[2] = values, squares, others
    sums[3], sums[4], sums[5] = own_values, own_squares, own_others


@njit(cache=True, nogil=True)
def _discriminant(
    image: NDArray[np.uint8],
    side: NDArray[np.uint8],
    wanted: NDArray[np.bool_],
    line: NDArray[np.float32],
) -> None:
    size = 2 * _REACH_PX + 1
    rows, total = np.empty((size, 6), np.int64), np.empty(6, np.int64)
    apart = np.empty((2, 7), np.float64)
    oldest = 0
    for col in range(side.shape[1]):
        known = False
        for row in range(side.shape[0]):
            if not wanted[row, col]:
                known = False
                continue
            if known:
                for k in range(6):
                    total[k] -= rows[oldest, k]
                _sum_row(image, side, row + _REACH_PX, col, rows[oldest])
                for k in range(6):
                    total[k] += rows[oldest, k]
                oldest = 0 if oldest == size - 1 else oldest + 1
            else:
                total[:] = 0
                for near in range(size):
                    _sum_row(image, side, row + near - _REACH_PX, col, rows[near])
                    for k in range(6):
                        total[k] += rows[near, k]
                known, oldest = True, 0
            for part in range(2):
                _means(total[3 * part : 3 * part + 3], apart[part])
            line[row, col] = 0
            if min(apart[0, 6], apart[1, 6]) < _LEAST_SHARE * size * size:
                continue
            for channel in range(3):
                one, two = apart[1, channel], apart[0, channel]
                spread = apart[1, channel + 3] - one * one + apart[0, channel + 3] - two * two
                slope = (one - two) / (max(spread, 0) / 2 + _NOISE * _NOISE)
                line[row, col, channel] = slope
                line[row, col, 3] += slope * (one + two) / 2


@njit(cache=True, nogil=True)
def _means(sums: NDArray[np.int64], out: NDArray[np.float64]) -> None:
    """Return means of three channels and of their squares, and the count, of packed sums."""
    count = sums[2] >> 32
    share = 1 / max(count, 1)
    for channel in range(3):
        out[channel] = ((sums[0] >> (21 * channel)) & 0x1FFFFF) * share
    out[3] = (sums[1] & 0xFFFFFFFF) * share
    out[4] = (sums[1] >> 32) * share
    out[5] = (sums[2] & 0xFFFFFFFF) * share
    out[6] = count


@njit(cache=True, nogil=True)
def _add(
    colours: NDArray[np.uint8],
    line: NDArray[np.float32],
    nearest: NDArray[np.int32],
    weight: float,
    logit: NDArray[np.float32],
) -> None:
    lines = line.reshape(-1, 4)
    for k in range(len(colours)):
        at = lines[nearest[k]]
        odds = -at[3]
        for channel in range(3):
            odds += at[channel] * colours[k, channel]
        logit[k] += weight * min(max(odds, -_LIMIT), _LIMIT)


def add_odds(
    colours: NDArray[np.uint8],
    line: NDArray[np.float32],
    nearest: NDArray[np.int32],
    weight: float,
    logit: NDArray[np.float32],
) -> None:
    """
    Add the log-odds of colours to a data term, in place.

    :param colours: (N, 3) uint8 in Lab.
    :param line: (h, w, 4) float32, see :func:`discriminant`; it changes slowly, so that of the
        nearest pixel will do.
    :param nearest: (N,) int32, where in it the pixel nearest to each colour's is.
    :param weight: of what is added.
    :param logit: (N,) float32, added to.
    """
    _add(colours, line, nearest, weight, logit)
