# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame at several sizes, made once for all who follow something in it."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['LEAST_RANGE', 'Pyramid']

_CELLS = 3
"""Halvings that make a cell a pixel."""

LEAST_RANGE = 8
"""Grey levels between the darkest and the brightest cell below which nothing can be seen."""


_ALIKE = 0.5
"""Correlation of the cells of two pictures from which they may show the same place."""


class Pyramid:
    """
    A grey image and smaller ones, each half the size of the one before.

    They are made when they are asked for.  A position in the image times ``0.5**level`` is that
    in the image of a level.
    """

    def __init__(self, gray: NDArray[np.uint8]) -> None:
        """Begin with the image at full size, (h, w) uint8."""
        self._images = [gray]

    @property
    def shape(self) -> tuple[int, ...]:
        """Return (h, w) of the image at full size."""
        return self._images[0].shape

    def image(self, level: int) -> NDArray[np.uint8]:
        """Return the image halved as often as ``level`` says."""
        while len(self._images) <= level:
            self._images.append(_halved(self._images[-1]))
        return self._images[level]

    @property
    def cells(self) -> NDArray[np.uint8]:
        """Return means of cells, in which noise and texture are far less: (h, w) uint8."""
        return self.image(_CELLS)

    @cached_property
    def is_blank(self) -> bool:
        """Return whether nothing can be seen, as when something covers the lens."""
        darkest, brightest, *_ = cv2.minMaxLoc(self.cells)
        return brightest - darkest < LEAST_RANGE

    def resembles(self, other: Pyramid) -> bool:
        """Return whether another picture, of the same size, may show the same place."""
        score = cv2.matchTemplate(self.cells, other.cells, cv2.TM_CCOEFF_NORMED)
        return float(score[0, 0]) > _ALIKE


def _halved(gray: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return means of 2 x 2 pixels, without the last row or column of an odd number."""
    size = (max(gray.shape[1] // 2, 1), max(gray.shape[0] // 2, 1))
    part = gray[: 2 * size[1], : 2 * size[0]]
    return np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA))
