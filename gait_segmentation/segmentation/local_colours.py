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


def discriminant(image: NDArray[np.uint8], labels: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return the linear discriminant of person and background about each pixel.

    :param image: (h, w, 3) uint8 in Lab, whose channels vary independently enough.
    :param labels: (h, w) bool, the cut.
    :returns: (h, w, 4) float32, (a, b, c, d) of the log-odds ``a x + b y + c z - d`` of a colour
        (x, y, z); 0 where there is only one side nearby.
    """
    inside = labels.view(np.uint8)
    kernel = np.ones((2 * _APART_PX + 1, 2 * _APART_PX + 1), np.uint8)
    person, person_square = _moments(image, cv2.erode(inside, kernel))
    ground, ground_square = _moments(image, 1 - cv2.dilate(inside, kernel))
    line = np.zeros((*labels.shape, 4), np.float32)
    _discriminant(person, person_square, ground, ground_square, line)
    return line


def _moments(
    image: NDArray[np.uint8], chosen: NDArray[np.uint8]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return means about each pixel: share of the chosen and their values; their squares."""
    size = (2 * _REACH_PX + 1, 2 * _REACH_PX + 1)
    values = cv2.bitwise_and(
        cv2.merge([*cv2.split(image), np.full_like(chosen, 255)]),
        cv2.merge([chosen * np.uint8(255)] * 4),
    )
    return (
        np.asarray(cv2.boxFilter(values, cv2.CV_32F, size), np.float32),
        np.asarray(cv2.sqrBoxFilter(values, cv2.CV_32F, size), np.float32),
    )


@njit(cache=True, nogil=True)
def _discriminant(
    person: NDArray[np.float32],
    person_square: NDArray[np.float32],
    ground: NDArray[np.float32],
    ground_square: NDArray[np.float32],
    line: NDArray[np.float32],
) -> None:
    for row in range(line.shape[0]):
        for col in range(line.shape[1]):
            if min(person[row, col, 3], ground[row, col, 3]) < 255 * _LEAST_SHARE:
                continue
            to_one, to_two = 255 / person[row, col, 3], 255 / ground[row, col, 3]
            for channel in range(3):
                one, two = person[row, col, channel] * to_one, ground[row, col, channel] * to_two
                spread = person_square[row, col, channel] * to_one - one * one
                spread += ground_square[row, col, channel] * to_two - two * two
                slope = (one - two) / (max(spread, 0) / 2 + _NOISE * _NOISE)
                line[row, col, channel] = slope
                line[row, col, 3] += slope * (one + two) / 2


@njit(cache=True, nogil=True)
def _add(
    image: NDArray[np.uint8],
    line: NDArray[np.float32],
    place: tuple[int, int, float],
    given: NDArray[np.int8],
    weight: float,
    logit: NDArray[np.float32],
) -> None:
    top, left, scale = place
    for row in range(given.shape[0]):
        nearest = min(int((row + top + 0.5) * scale), line.shape[0] - 1)
        for col in range(given.shape[1]):
            if given[row, col] != 0:
                continue
            at = line[nearest, min(int((col + left + 0.5) * scale), line.shape[1] - 1)]
            odds = -at[3]
            for channel in range(3):
                odds += at[channel] * image[row, col, channel]
            logit[row, col] += weight * min(max(odds, -_LIMIT), _LIMIT)


def add_odds(
    image: NDArray[np.uint8],
    line: NDArray[np.float32],
    place: tuple[int, int, float],
    given: NDArray[np.int8],
    weight: float,
    logit: NDArray[np.float32],
) -> None:
    """
    Add the log-odds of the colours to a data term, in place.

    :param image: (H, W, 3) uint8 in Lab, finer than the discriminant.
    :param line: (h, w, 4) float32, see :func:`discriminant`; it changes slowly, so that of the
        nearest pixel will do.
    :param place: row and column of the image's first pixel, and the size of its pixels in those of
        the discriminant.
    :param given: (H, W) int8, non-zero where nothing is to be added.
    :param weight: of what is added.
    :param logit: (H, W) float32, added to.
    """
    _add(image, line, place, given, weight, logit)
