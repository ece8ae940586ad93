# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame that is learnt tells of the surroundings of people, at half of its size."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.tracking.background_kernels import SURE_COUNT
from gait_segmentation.tracking.outline import halved, thinned
from gait_segmentation.tracking.records import Record

__all__ = ['Beside']


class Beside:
    """
    What is strange about people who are tracked, and where they are themselves.

    All are (h, w) uint8 at half the working size, of every second pixel: ``strange`` is 255 on
    what is not the known background, ``masks`` non-zero on who is tracked, ``people`` on that with
    a margin, ``templates`` on the bodies that were matched.
    """

    def __init__(
        self, record: Record, people: NDArray[np.uint8], moving: NDArray[np.uint8] | None
    ) -> None:
        """
        Begin without anybody.

        :param record: the frame.
        :param people: (H, W) uint8 of the working image, non-zero where people may be.
        :param moving: (H, W) uint8, non-zero on people and what else moves, None if that is not
            known.
        """
        height, width = people.shape
        self.record = record
        self.shape = (height // 2, width // 2)
        self._moving = moving
        self.people = people[: height // 2 * 2 : 2, : width // 2 * 2 : 2]
        self.strange, self.masks, self.templates = (np.zeros(self.shape, np.uint8) for _ in 'abc')

    def add(
        self,
        window: Window,
        strange: NDArray[np.uint8],
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8],
    ) -> None:
        """
        Add what is about a person.

        :param window: rows and columns about the person.
        :param strange: (h, w) uint8 0/1 of the window, what is not the known background.
        :param mask, template: (H, W) uint8 of the working image.
        """
        half = halved(window)
        every = _every(half)
        found = np.multiply(strange[thinned(window, half)], np.uint8(255))
        if self._moving is not None:
            # What moves where nothing is known yet.
            unknown = self.record.background.count[every] < SURE_COUNT
            found[unknown & (self._moving[every] > 0)] = 255
        self.strange[half] |= found
        self.masks[half] |= mask[every]
        self.templates[half] |= cv2.inRange(np.ascontiguousarray(template[every]), 128, 255)

    @cached_property
    def distance(self) -> NDArray[np.float32]:
        """Return how far pixels are from all templates, in pixels of half the size."""
        if not self.templates.any():
            return np.full(self.shape, np.float32(np.inf))
        return np.asarray(cv2.distanceTransform(cv2.bitwise_not(self.templates), cv2.DIST_L2, 3))

    def far(self, window: Window, margin: float) -> NDArray[np.bool_]:
        """Return which pixels of rows and columns are farther than that from all templates."""
        return self.distance[window] > np.float32(margin)

    def moves(self, window: Window, part: NDArray[np.bool_]) -> float:
        """Return the share of a part of some rows and columns that moves, 1 if it is not known."""
        if self._moving is None:
            return 1.0
        moving = self._moving[_every(window)] > 0
        return float(np.count_nonzero(moving & part)) / max(int(np.count_nonzero(part)), 1)


def _every(half: Window) -> Window:
    """Return the rows and columns of the working image that stand for some at half the size."""
    rows, columns = (slice(2 * side.start, 2 * side.stop, 2) for side in half)
    return rows, columns
