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
def _add_row(
    image: NDArray[np.uint8],
    side: NDArray[np.uint8],
    row: int,
    first: int,
    sign: int,
    sums: NDArray[np.int64],
) -> None:
    """
    Add a row to the sums of columns, or take it off again.

    Several numbers share a word: they never overflow, as what is added is taken off, and what is
    read is the sum of one neighbourhood.

    :param first: the first column.
    :param sums: (6, n) int64, for background and person: values of the three channels, 21 bits
        each; squares of the first two, 32 bits each; squares of the third and the count.
    """
    if not 0 <= row < side.shape[0]:
        return
    sides, colours = side[row, first:], image[row, first:]
    for k in range(sums.shape[1]):
        one, two = np.int64(colours[k, 0]), np.int64(colours[k, 1])
        three = np.int64(colours[k, 2])
        # All bits where it counts, so that nothing has to be jumped over.
        is_person = -np.int64(sides[k] >> 1)
        is_ground = -np.int64(sides[k] == 0)
        values = sign * (one + (two << 21) + (three << 42))
        squares = sign * (one * one + ((two * two) << 32))
        others = sign * (three * three + (1 << 32))
        sums[0, k] += values & is_ground
        sums[1, k] += squares & is_ground
        sums[2, k] += others & is_ground
        sums[3, k] += values & is_person
        sums[4, k] += squares & is_person
        sums[5, k] += others & is_person


@njit(cache=True, nogil=True)
def _discriminant(
    image: NDArray[np.uint8],
    side: NDArray[np.uint8],
    wanted: NDArray[np.bool_],
    line: NDArray[np.float32],
) -> None:
    height, width = side.shape
    top, bottom, left, right = height, -1, width, -1
    for row in range(height):
        for col in range(width):
            if wanted[row, col]:
                top, bottom = min(top, row), row
                left, right = min(left, col), max(right, col)
    if bottom < 0:
        return
    size = 2 * _REACH_PX + 1
    first, last = max(left - _REACH_PX, 0), min(right + _REACH_PX + 1, width)
    columns = np.zeros((6, last - first), np.int64)
    running = np.zeros((6, last - first + 1), np.int64)
    about = np.empty(6, np.int64)
    apart = np.empty((2, 7), np.float64)
    for row in range(top - _REACH_PX, top + _REACH_PX):
        _add_row(image, side, row, first, 1, columns)
    for row in range(top, bottom + 1):
        _add_row(image, side, row + _REACH_PX, first, 1, columns)
        for k in range(6):
            for place in range(last - first):
                running[k, place + 1] = running[k, place] + columns[k, place]
        for col in range(left, right + 1):
            if not wanted[row, col]:
                continue
            start = max(col - _REACH_PX, first) - first
            stop = min(col + _REACH_PX + 1, last) - first
            for k in range(6):
                about[k] = running[k, stop] - running[k, start]
            for part in range(2):
                _means(about[3 * part : 3 * part + 3], apart[part])
            line[row, col] = 0
            if min(apart[0, 6], apart[1, 6]) < _LEAST_SHARE * size * size:
                continue
            for channel in range(3):
                one, two = apart[1, channel], apart[0, channel]
                spread = apart[1, channel + 3] - one * one + apart[0, channel + 3] - two * two
                slope = (one - two) / (max(spread, 0) / 2 + _NOISE * _NOISE)
                line[row, col, channel] = slope
                line[row, col, 3] += slope * (one + two) / 2
        _add_row(image, side, row - _REACH_PX, first, -1, columns)


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
