# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks at half of the working size, cut out: for what need not be known to the pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, bounding_box, overlap, within
from gait_segmentation.tracking.picture.working import WorkingImage

__all__ = ['Outline', 'doubled', 'every', 'halved', 'lab_of']


@dataclass(frozen=True)
class Outline:
    """
    A mask at half size: (h, w) uint8, non-zero inside, and the row and column it begins in.

    ``inside`` has no pixels where nothing is inside.  ``rest`` is what shifts in (x, y) left over
    that were no whole pixels: it counts the next time.
    """

    top: int
    left: int
    inside: NDArray[np.uint8]
    rest: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def of(cls, mask: NDArray[np.uint8], top: int = 0, left: int = 0) -> Outline:
        """
        Cut out a mask.

        :param mask: (h, w) uint8 at half size, non-zero inside.
        :param top: the row it begins in; ``left`` likewise the column.
        """
        x, y, width, height = bounding_box(np.ascontiguousarray(mask))
        part = np.ascontiguousarray(mask[y : y + height, x : x + width])
        return cls(top + y, left + x, part)

    @property
    def window(self) -> Window:
        """Return its rows and columns at half size."""
        height, width = self.inside.shape
        return slice(self.top, self.top + height), slice(self.left, self.left + width)

    @property
    def area(self) -> int:
        """Return how many pixels of half the size are inside."""
        return int(cv2.countNonZero(self.inside)) if self.inside.size else 0

    def shifted(self, dx: float, dy: float) -> Outline:
        """Return the outline moved by a shift in pixels of the working image."""
        x, y = self.rest[0] + dx / 2, self.rest[1] + dy / 2
        right, down = round(x), round(y)
        return Outline(self.top + down, self.left + right, self.inside, (x - right, y - down))

    def about(self, margin: float, shape: tuple[int, int]) -> Window:
        """
        Return the rows and columns about it, with a margin, in an image at half size.

        :param margin: in pixels of half the size.
        :param shape: (h, w) of that image.
        """
        reach = int(margin) + 1 if margin else 0
        (top, bottom), (left, right) = (
            (
                min(max(side.start - reach, 0), size),
                min(max(side.stop + reach, 0), size),
            )
            for side, size in zip(self.window, shape, strict=True)
        )
        return slice(top, bottom), slice(left, right)

    def seen_in(self, window: Window) -> NDArray[np.uint8]:
        """Return the mask in rows and columns at half size, (h, w) uint8."""
        rows, columns = window
        out = np.zeros(
            (max(rows.stop - rows.start, 0), max(columns.stop - columns.start, 0)), np.uint8
        )
        shared = overlap(self.window, window)
        if shared is not None:
            out[within(shared, window)] = self.inside[within(shared, self.window)]
        return out

    def enlarged(self, window: Window) -> NDArray[np.uint8]:
        """Return the mask in rows and columns of the working image, (h, w) uint8."""
        (top, bottom), (left, right) = ((side.start, side.stop) for side in window)
        first, start = top // 2, left // 2
        half = self.seen_in((slice(first, (bottom + 1) // 2), slice(start, (right + 1) // 2)))
        rows = slice(top - 2 * first, bottom - 2 * first)
        columns = slice(left - 2 * start, right - 2 * start)
        return half.repeat(2, axis=0).repeat(2, axis=1)[rows, columns]


def halved(window: Window) -> Window:
    """Return the rows and columns at half size of which all pixels lie in a window."""
    rows, columns = (slice((side.start + 1) // 2, side.stop // 2) for side in window)
    return rows, columns


def every(half: Window) -> Window:
    """Return the rows and columns of the working image that stand for some at half size."""
    rows, columns = (slice(2 * side.start, 2 * side.stop, 2) for side in half)
    return rows, columns


def doubled(window: Window) -> Window:
    """Return the rows and columns of the working image of some at half size."""
    rows, columns = (slice(2 * side.start, 2 * side.stop) for side in window)
    return rows, columns


def lab_of(image: WorkingImage, half: Window) -> NDArray[np.uint8]:
    """Return the pixels that stand for rows and columns at half size in Lab, (h, w, 3) uint8."""
    # As a rule the window is in Lab already, unlike with WorkingImage.lab_every.
    return np.ascontiguousarray(image.lab_about(doubled(half))[every(half)])
