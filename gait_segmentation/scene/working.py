# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The working image, shared by all cues: the source scaled down once, in Lab and at half sizes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import gray_lab
from gait_segmentation.images import Window, shrink

CELL_LEVEL = 3
"""Halvings that make a cell a pixel: noise, texture and small motions count little in cells."""

LEAST_RANGE = 8
"""Grey levels between the darkest and the brightest cell below which nothing can be seen."""

_ALIKE = 0.3
"""Correlation of cells from which they may show the same place, in whatever light."""

_Level = TypeVar('_Level', np.uint8, np.float32)


def are_alike(one: NDArray[_Level], other: NDArray[_Level]) -> bool:
    """Return whether cells of two pictures, (h, w), may be those of the same place."""
    return float(cv2.matchTemplate(one, other, cv2.TM_CCOEFF_NORMED)[0, 0]) > _ALIKE


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
            last = self._images[-1]
            half = max(last.shape[0] // 2, 1), max(last.shape[1] // 2, 1)
            self._images.append(shrink(last, half))
        return self._images[level]

    @property
    def cells(self) -> NDArray[np.uint8]:
        """Return means of cells, (h, w) uint8."""
        return self.image(CELL_LEVEL)

    @cached_property
    def is_blank(self) -> bool:
        """Return whether nothing can be seen, as when something covers the lens."""
        darkest, brightest, *_ = cv2.minMaxLoc(self.cells)
        return brightest - darkest < LEAST_RANGE

    def resembles(self, other: Pyramid) -> bool:
        """Return whether another picture, of the same size, may show the same place."""
        return are_alike(self.cells, other.cells)


@dataclass(frozen=True)
class WorkingImage:
    """
    One frame at working size.

    ``bgr`` is (h, w, 3) uint8, ``gray`` its brightness, (h, w) uint8, with which ``pyramid``
    begins; ``textured`` says that it has no colour and shows gradient energy in the place of a*
    and b* (:func:`.gray_lab`); ``faded`` that it has none although earlier ones had.
    """

    stamp_ns: int
    bgr: NDArray[np.uint8]
    gray: NDArray[np.uint8]
    pyramid: Pyramid
    textured: bool
    faded: bool = False

    def shrunk(self, shape: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the image in Lab at a smaller (h, w), (h, w, 3) uint8; see :attr:`lab`."""
        if self.textured:
            return gray_lab(shrink(self.gray, shape, cv2.INTER_AREA))
        small = shrink(self.bgr, shape, cv2.INTER_AREA)
        return np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2Lab))

    @cached_property
    def lab(self) -> NDArray[np.uint8]:
        """Return the image in CIE L*a*b* as OpenCV stores it, (h, w, 3) uint8."""
        return self.shrunk((self.gray.shape[0], self.gray.shape[1]))

    def lab_part(self, window: Window) -> NDArray[np.uint8]:
        """Return a window in Lab, (h, w, 3) uint8, its rows contiguous as kernels want them."""
        return np.ascontiguousarray(self.lab[window])


def working_scale(
    height: int, width: int, *, working_size: int, person_height: float, working_height: int
) -> float:
    """Return the factor from source to working size, at most 1 (small people stay as they are)."""
    scale = min(1.0, working_height / person_height)
    if working_size > 0:
        scale = min(scale, working_size / max(height, width))
    return scale


def working_shape(height: int, width: int, scale: float) -> tuple[int, int]:
    """Return (h, w) of the working image of a source of the given size."""
    return max(1, round(height * scale)), max(1, round(width * scale))
