# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of the still world."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import carry, compose, invert, scaling
from gait_segmentation.images import Window
from gait_segmentation.warping import warp_window

__all__ = ['WorldMotion']

_STILL = scaling(1.0)


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
