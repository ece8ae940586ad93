# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of padded images."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['WindowGrid']


@dataclass(frozen=True)
class WindowGrid:
    """
    A regular grid of windows in each of several padded images.

    There are ``rows`` x ``columns`` windows, each ``step`` pixels from the next, of ``height`` x
    ``width`` pixels.
    """

    height: int
    width: int
    rows: int
    columns: int
    step: int = 1

    @property
    def image_shape(self) -> tuple[int, int]:
        """Return the (height, width) of a padded image."""
        return (
            self.height + (self.rows - 1) * self.step,
            self.width + (self.columns - 1) * self.step,
        )

    def part(self, row: int, column: int) -> tuple[slice, slice]:
        """Return the rows and columns of a padded image that a window has."""
        top, left = row * self.step, column * self.step
        return slice(top, top + self.height), slice(left, left + self.width)

    def windows(self, images: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """
        Return all windows as a view.

        :param images: (S, *self.image_shape) uint8.
        :returns: (S, rows, columns, height, width).
        """
        view = np.lib.stride_tricks.sliding_window_view(
            images, (self.height, self.width), axis=(1, 2)
        )
        return view[:, :: self.step, :: self.step]

    def areas(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """
        Return the sums over all windows.

        :param images: (S, *self.image_shape) uint8.
        :returns: (S, rows, columns) int32.
        """
        sums = np.stack([cv2.integral(image) for image in images])
        rows = self.step * np.arange(self.rows)[:, None]
        columns = self.step * np.arange(self.columns)
        below, right = rows + self.height, columns + self.width
        return np.asarray(
            sums[:, below, right]
            - sums[:, below, columns]
            - sums[:, rows, right]
            + sums[:, rows, columns]
        )
