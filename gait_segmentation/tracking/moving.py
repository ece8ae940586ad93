# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves against the still world at all: it is no background."""

from __future__ import annotations

import math
from collections.abc import Iterable

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.records import Record

__all__ = ['add_moving', 'moving_pixels']

_GAP = 3
"""Frames between the two that are compared."""

_LEVEL, _SPREADS = 6.0, 2.0
"""Change that is motion: grey levels, and spreads of a still pixel on top."""

_SIDE, _REACH = 5, 2
"""Side in pixels of the squares that changes are averaged over and that motion is widened by."""


def add_moving(
    people: NDArray[np.uint8], record: Record, frames: Iterable[Record], spread: float
) -> None:
    """
    Add to people what else moves against the world, in the windows of a frame.

    :param people: (H, W) uint8, non-zero where people may be.
    :param record: the frame.
    :param frames: those kept, oldest first; nothing is added if none of them is earlier.
    :param spread: of a still pixel about its mean, in grey levels.
    """
    kept = list(frames)
    index = next((k for k, each in enumerate(kept) if each is record), 0)
    if index == 0:
        return
    first = max(0, index - _GAP)
    earlier = kept[first]
    motion = WorldMotion.over(each.motion for each in kept[first + 1 : index + 1])
    for window in record.windows:
        moving = moving_pixels(record.image.gray, earlier.image.gray, motion, window, spread)
        if earlier.people is not None:
            # What people have just uncovered has changed but is background.
            left = motion.warped(earlier.people, window, cv2.BORDER_CONSTANT)
            moving &= cv2.inRange(left, 0, 0)
        people[window] |= moving


def moving_pixels(
    gray: NDArray[np.uint8],
    earlier: NDArray[np.uint8],
    motion: WorldMotion,
    window: Window,
    spread: float,
) -> NDArray[np.uint8]:
    """
    Return where something moves against the still world, (h, w) uint8, 1 where it does.

    :param gray: (H, W) uint8 brightness of this frame.
    :param earlier: (H, W) uint8, that of a frame some frames back.
    :param motion: of the still world from then to now.
    :param window: rows and columns to look at.
    :param spread: of a still pixel about its mean, in grey levels.
    """
    then = motion.warped(earlier, window)
    height, width = then.shape
    if then.size == 0:
        return np.zeros(then.shape, np.uint8)
    change = cv2.absdiff(gray[window], then)
    size = _REACH
    change = np.asarray(cv2.copyMakeBorder(change, size, size, size, size, cv2.BORDER_REFLECT_101))
    # The mean change, rounded, must be above the level.
    most = math.floor(_LEVEL + _SPREADS * spread) * _SIDE * _SIDE + _SIDE * _SIDE // 2
    moving = np.empty((height, change.shape[1]), np.uint8)
    _mark(change.ravel(), change.shape[1], min(most, 65535), moving.ravel())
    return moving[:, :width]


@kernel('u1[::1], i8, i8, u1[::1]')
def _mark(change: NDArray[np.uint8], step: int, most: int, out: NDArray[np.uint8]) -> None:
    """
    Set the squares about pixels in the squares about which the changes add up to more than most.

    The rows are taken for one long row, which is done many pixels at a time; what is made of the
    end of one and the beginning of the next lies in the border, and is nothing.

    :param change: (h + 4) * (w + 4) pixels, an image with a border, row by row.
    :param step: pixels from one row to the next, w + 4.
    :param out: h * (w + 4) pixels; the last four of each row do not count.
    """
    size = out.size
    total = np.zeros(size + _SIDE - 1, np.uint16)
    _add_five(change, step, total[:size])
    marks = np.zeros(change.size + _SIDE - 1, np.uint8)
    found = marks[_REACH * (step + 1) :][:size]
    b, c, d, e = total[1:], total[2:], total[3:], total[4:]
    bound = np.uint16(most)
    for k in range(size):
        change_of_square = np.uint16(total[k] + b[k] + c[k] + d[k] + e[k])
        found[k] = np.uint8(change_of_square > bound)
    for end in range(step, size + 1, step):
        found[end - _SIDE + 1 : end] = 0
    across = np.empty(change.size, np.uint8)
    _any_of_five(marks, 1, across)
    _any_of_five(across, step, out)


@njit(nogil=True, inline='always')
def _add_five(values: NDArray[np.uint8], step: int, out: NDArray[np.uint16]) -> None:
    """Add up each value and the four that follow at a distance."""
    b, c, d, e = values[step:], values[2 * step :], values[3 * step :], values[4 * step :]
    for k in range(out.size):
        one = np.uint16(values[k]) + np.uint16(b[k]) + np.uint16(c[k])
        out[k] = one + np.uint16(d[k]) + np.uint16(e[k])


@njit(nogil=True, inline='always')
def _any_of_five(values: NDArray[np.uint8], step: int, out: NDArray[np.uint8]) -> None:
    """Combine the bits of each value and the four that follow at a distance."""
    b, c, d, e = values[step:], values[2 * step :], values[3 * step :], values[4 * step :]
    for k in range(out.size):
        out[k] = values[k] | b[k] | c[k] | d[k] | e[k]
