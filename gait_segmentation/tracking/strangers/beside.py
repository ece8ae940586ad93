# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame that is learnt tells of the surroundings of people, at half of its size."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.background.kernels import SURE_COUNT
from gait_segmentation.tracking.outline import halved
from gait_segmentation.tracking.records import Record

__all__ = ['Beside']


class Beside:
    """
    What is strange about people who are tracked, and where they are themselves.

    All are (h, w) uint8 0/255 at half the working size, of every second pixel: ``strange`` is what
    is not the known background, ``masks`` who is tracked, ``people`` that with a margin,
    ``templates`` the bodies that were matched, ``moving`` what moves against the still world.
    They are known in the windows about people.
    """

    def __init__(
        self, record: Record, people: NDArray[np.uint8], moving: NDArray[np.uint8] | None
    ) -> None:
        """
        Begin without anybody.

        :param record: the frame.
        :param people: (H, W) uint8 of the working image, non-zero where people may be.
        :param moving: (H, W) uint8, non-zero on people and what else moves, None if that is not
            known: then all may move.
        """
        height, width = people.shape
        self.record = record
        self.shape = (height // 2, width // 2)
        self._people, self._moving = people, moving
        self.strange, self.masks, self.people, self.templates, self.moving = np.zeros(
            (5, *self.shape), np.uint8
        )

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
        rows, columns = halved(window)
        _thin(
            (rows.start, rows.stop, columns.start, columns.stop),
            (window[0].start, window[1].start),
            strange,
            mask,
            template,
            self._people,
            self._people if self._moving is None else self._moving,
            self._moving is not None,
            self.record.background.sums,
            (self.strange, self.masks, self.people, self.templates, self.moving),
        )

    def far(self, window: Window, margin: float) -> NDArray[np.uint8]:
        """
        Return which pixels of rows and columns are far from all templates.

        :param margin: in pixels of half the size.
        :returns: (h, w) uint8 0/255.
        """
        (top, bottom), (left, right) = ((side.start, side.stop) for side in window)
        reach = math.ceil(margin)
        first, start = max(top - reach, 0), max(left - reach, 0)
        about = self.templates[first : bottom + reach, start : right + reach]
        if not about.any():
            return np.full((bottom - top, right - left), 255, np.uint8)
        distance = cv2.distanceTransform(cv2.bitwise_not(about), cv2.DIST_L2, 3)
        part = distance[top - first : bottom - first, left - start : right - start]
        return np.asarray(cv2.inRange(part, margin, math.inf))


@kernel(
    'UniTuple(i8, 4), UniTuple(i8, 2), u1[:,::1], u1[:,::1], u1[:,::1], u1[:,::1], '
    'u1[:,::1], b1, f4[:,:,::1], UniTuple(u1[:,::1], 5)'
)
def _thin(
    part: tuple[int, int, int, int],
    corner: tuple[int, int],
    strange: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    template: NDArray[np.uint8],
    people: NDArray[np.uint8],
    moving: NDArray[np.uint8],
    moving_known: bool,
    sums: NDArray[np.float32],
    out: tuple[
        NDArray[np.uint8],
        NDArray[np.uint8],
        NDArray[np.uint8],
        NDArray[np.uint8],
        NDArray[np.uint8],
    ],
) -> None:
    """
    Fill in every second pixel of a window.

    :param part: first row and the one after the last at half size, and the same of the columns.
    :param corner: row and column in the image in which ``strange`` begins.
    :param out: what is strange, of people, of people with a margin, of templates, and moves.
    """
    top, bottom, left, right = part
    on, off = np.uint8(255), np.uint8(0)
    for row in range(top, bottom):
        y = 2 * row
        for col in range(left, right):
            x = 2 * col
            moves = not moving_known or moving[y, x] != 0
            found = strange[y - corner[0], x - corner[1]] != 0
            # What moves where nothing is known yet.
            found |= moving_known and moves and sums[y, x, 3] < SURE_COUNT
            out[0][row, col] |= on if found else off
            out[1][row, col] |= on if mask[y, x] != 0 else off
            out[2][row, col] |= on if people[y, x] != 0 else off
            out[3][row, col] |= on if template[y, x] > 127 else off
            out[4][row, col] |= on if moves else off
