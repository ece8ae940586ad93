# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of the still world, and images that are warped by it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import carry, compose, invert, pixel_affine, scaling
from gait_segmentation.images import Window

_STILL = scaling(1.0)

_Pixel = TypeVar('_Pixel', np.uint8, np.float32)


@dataclass(frozen=True)
class WorldMotion:
    """
    How the still world moved from an earlier frame to a later one, in working pixels.

    ``camera`` is the 2 x 3 transform of its positions, None when it did not move.
    """

    camera: NDArray[np.float64] | None = None

    @classmethod
    def over(cls, steps: Iterable[WorldMotion]) -> WorldMotion:
        """
        Return the motion over several frames.

        :param steps: from each frame to the next, oldest first.
        """
        total = None
        for step in steps:
            if step.camera is not None:
                total = step.camera if total is None else compose(step.camera, total)
        return cls(total)

    @property
    def transform(self) -> NDArray[np.float64]:
        """Return the 2 x 3 transform of positions, also of a world that did not move."""
        return _STILL if self.camera is None else self.camera

    def carry(self, x: float, y: float) -> tuple[float, float]:
        """Return where a position of the world moved to."""
        return (x, y) if self.camera is None else carry(self.camera, x, y)

    def inverse(self) -> WorldMotion:
        """Return how the world moved from the later frame to the earlier one."""
        return self if self.camera is None else WorldMotion(invert(self.camera))

    def warped(
        self, image: NDArray[np.uint8], window: Window, border: int = cv2.BORDER_REPLICATE
    ) -> NDArray[np.uint8]:
        """
        Return a window of an image of the earlier frame as it looks in the later one.

        :param image: (H, W) or (H, W, C) uint8.
        :param window: the rows and columns to compute.
        :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
        """
        return warp_window(image, self.transform, window, border)


def warp_window(
    image: NDArray[_Pixel],
    motion: NDArray[np.float64],
    window: Window,
    border: int = cv2.BORDER_REPLICATE,
    interpolation: int = cv2.INTER_LINEAR,
) -> NDArray[_Pixel]:
    """
    Warp an image by a transform of positions and return a window of the result.

    :param image: (H, W) or (H, W, C) uint8 or float32.
    :param motion: 2 x 3 transform of positions from the image to the result.
    :param window: the rows and columns to compute.
    :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
    :param interpolation: a ``cv2.INTER_`` constant.
    """
    rows, columns = window
    inside = rows.stop <= image.shape[0] and columns.stop <= image.shape[1]
    if inside and (motion == _STILL).all():
        return image[window].copy()
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if min(size) <= 0:
        # OpenCV would take the image's size.
        return np.empty((max(size[1], 0), max(size[0], 0), *image.shape[2:]), image.dtype)
    matrix = pixel_affine(motion)
    matrix[:, 2] -= (columns.start, rows.start)
    return np.asarray(cv2.warpAffine(image, matrix, size, flags=interpolation, borderMode=border))
