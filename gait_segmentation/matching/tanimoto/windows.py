# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of padded images."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

__all__ = ['WindowGrid', 'check_templates']

_MOST_PIXELS = (2**31 - 1) // 255


@dataclass(frozen=True)
class WindowGrid:
    """
    A regular grid of windows in each of several padded images.

    There are ``rows`` x ``columns`` windows, each ``step`` pixels from the next, of ``height`` x
    ``width`` pixels.

    :raises InputError: if a value is not positive.
    """

    height: int
    width: int
    rows: int
    columns: int
    step: int = 1

    def __post_init__(self) -> None:
        """Refuse empty grids."""
        values = (self.height, self.width, self.rows, self.columns, self.step)
        if min(values) < 1:
            raise InputError(f'sizes of a window grid must be positive, got {values}')

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
        :raises InputError: if shape or type of the images is another.
        """
        self.check(images)
        view = np.lib.stride_tricks.sliding_window_view(
            images, (self.height, self.width), axis=(1, 2)
        )
        return view[:, :: self.step, :: self.step]

    def areas(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """
        Return the sums over all windows.

        :param images: (S, *self.image_shape) uint8.
        :returns: (S, rows, columns) int32.
        :raises InputError: if shape or type of the images is another.
        """
        self.check(images)
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

    def check(self, images: NDArray[np.uint8]) -> None:
        """
        Refuse images that do not fit the grid.

        :raises InputError: if shape or type is another.
        """
        if images.dtype != np.uint8 or images.ndim != 3 or images.shape[1:] != self.image_shape:
            height, width = self.image_shape
            raise InputError(
                f'images must be (scales, {height}, {width}) uint8, got '
                f'{images.shape} {images.dtype}'
            )


def check_templates(templates: NDArray[np.uint8], grid: WindowGrid) -> None:
    """
    Refuse templates a kernel cannot be made of.

    :raises InputError: if there are none, they do not have the grid's size, or sums over them
        would not fit 32 bits.
    """
    if templates.dtype != np.uint8 or templates.ndim != 3 or len(templates) == 0:
        raise InputError(
            'templates must be (templates, height, width) uint8, at least one, got '
            f'{templates.shape} {templates.dtype}'
        )
    if templates.shape[1:] != (grid.height, grid.width):
        raise InputError(
            f'templates must be {grid.height} x {grid.width} like the windows, got '
            f'{templates.shape[1]} x {templates.shape[2]}'
        )
    if grid.height * grid.width > _MOST_PIXELS:
        raise InputError(
            f'templates must have at most {_MOST_PIXELS} pixels, got {grid.height * grid.width}'
        )
