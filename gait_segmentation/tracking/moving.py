# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves against the still world at all: it is no background."""

from __future__ import annotations

import math
from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.scene.world_motion import WorldMotion
from gait_segmentation.tracking.records import Record

__all__ = ['add_moving', 'moving_pixels']

_GAP = 3
"""Frames between the two that are compared."""

_LEVEL, _SPREADS = 6.0, 2.0
"""Change that is motion: grey levels, and spreads of a still pixel on top."""

_SIDE = 5
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
    if then.size == 0:
        return np.zeros(then.shape, np.uint8)
    change = cv2.blur(cv2.absdiff(gray[window], then), (_SIDE, _SIDE))
    level = math.floor(_LEVEL + _SPREADS * spread)
    _, moving = cv2.threshold(change, level, 1, cv2.THRESH_BINARY)
    return np.asarray(cv2.dilate(moving, np.ones((_SIDE, _SIDE), np.uint8)))
