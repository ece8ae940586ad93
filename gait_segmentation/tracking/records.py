# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept of the last frames, and how bodies moved over some of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.working import WorkingImage
from gait_segmentation.scene.world_motion import WorldMotion

Shift = tuple[float, float]

_GAP = 3
"""Frames between the two that are compared."""

_LEVEL, _SPREADS = 6.0, 2.0
"""Change that is motion: grey levels, and spreads of a still pixel on top."""

_SIDE = 5
"""Side in pixels of the squares that changes are averaged over and that motion is widened by."""


@dataclass
class Record:
    """
    One frame, kept until its feedback came and as long as the cue from motion needs it.

    ``motion`` is how the world moved since the frame before.
    ``windows`` are the parts in which the background is known and learnt, disjoint.
    ``bodies`` has the shift of each body since the frame before, by track id; a track that is not
    in it did not exist.  ``notes`` has by track and cue a window and (h, w) uint8, what the cue
    will learn from when the mask comes.  ``heat`` is (h, w) uint8, P(person) as others see it, if
    they do, of ``heat_frames`` frames before; ``people`` is (h, w) uint8, non-zero where people
    were when the frame was learnt, None before.  ``outdated`` tells that more is known of the
    background by now, ``blank`` that nothing of the scene can be seen: something covers the lens,
    the picture is damaged, or it shows another place.
    """

    image: WorkingImage
    motion: WorldMotion
    background: BackgroundModel
    windows: list[Window]
    heat: NDArray[np.uint8] | None = None
    heat_frames: int = 0
    blank: bool = False
    outdated: bool = False
    people: NDArray[np.uint8] | None = None
    bodies: dict[int, Shift] = field(default_factory=dict)
    notes: dict[tuple[int, str], tuple[Window, NDArray[np.uint8]]] = field(default_factory=dict)

    def strange(self, window: Window, shadow_floor: float) -> NDArray[np.uint8]:
        """
        Return where a window does not look like the known background, (h, w) uint8 0/1.

        :param shadow_floor: darkest shadow, as a share of the lightness; shadows are background.
        """
        return self.background.contradicted(self.image.lab_part(window), window, shadow_floor)


def body_over(records: Iterable[Record], track_id: int) -> Shift:
    """Return how far a body went over several frames."""
    shifts = [each.bodies[track_id] for each in records if track_id in each.bodies]
    return sum(dx for dx, _ in shifts), sum(dy for _, dy in shifts)


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
