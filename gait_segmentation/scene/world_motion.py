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

from gait_segmentation.images import Window

_STILL = np.eye(3)
# From positions to indices of pixels, whose centres are half a pixel on, and back.
_TO_INDEX = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]])
_FROM_INDEX = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
_Pixel = TypeVar('_Pixel', np.uint8, np.float32)


@dataclass(frozen=True)
class WorldMotion:
    """
    How the still world moved from an earlier frame to a later one, in working pixels.

    ``camera`` is the 3 x 3 homography of its positions, None when it did not move.
    """

    camera: NDArray[np.float64] | None = None

    @classmethod
    def over(cls, steps: Iterable[WorldMotion]) -> WorldMotion:
        """Return the motion over several frames, from each to the next, oldest first."""
        total = None
        for step in steps:
            if step.camera is not None:
                total = step.camera if total is None else step.camera @ total
        return cls(total)

    def carry(self, x: float, y: float) -> tuple[float, float]:
        """Return where a position of the world moved to."""
        if self.camera is None:
            return x, y
        # In plain numbers, which is faster.
        (a, b, c), (d, e, f), (g, h, i) = self.camera.tolist()
        depth = g * x + h * y + i
        return (a * x + b * y + c) / depth, (d * x + e * y + f) / depth

    def inverse(self) -> WorldMotion:
        """Return how the world moved from the later frame to the earlier one."""
        return self if self.camera is None else WorldMotion(np.asarray(np.linalg.inv(self.camera)))

    def scaled(self, across: float, down: float) -> WorldMotion:
        """Return it in the pixels of an image so many times as wide and as high."""
        if self.camera is None:
            return self
        scale = np.array([across, down, 1.0])
        return WorldMotion(scale[:, None] * self.camera / scale)

    def warped(
        self,
        image: NDArray[_Pixel],
        window: Window,
        border: int = cv2.BORDER_REPLICATE,
        interpolation: int = cv2.INTER_LINEAR,
    ) -> NDArray[_Pixel]:
        """
        Return a window of an image of the earlier frame as it looks in the later one.

        :param image: (H, W) or (H, W, C) uint8 or float32.
        :param window: the rows and columns to compute.
        :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
        :param interpolation: a ``cv2.INTER_`` constant.
        """
        camera = _STILL if self.camera is None else self.camera
        rows, columns = window
        inside = rows.stop <= image.shape[0] and columns.stop <= image.shape[1]
        if inside and (camera == _STILL).all():
            return image[window].copy()
        size = (columns.stop - columns.start, rows.stop - rows.start)
        if min(size) <= 0:
            # OpenCV would take the image's size.
            return np.empty((max(size[1], 0), max(size[0], 0), *image.shape[2:]), image.dtype)
        matrix = _TO_INDEX @ camera @ _FROM_INDEX
        matrix[:2] -= np.outer((columns.start, rows.start), matrix[2])
        return np.asarray(
            cv2.warpPerspective(image, matrix, size, flags=interpolation, borderMode=border)
        )
