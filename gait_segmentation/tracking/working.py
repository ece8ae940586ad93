# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The working image: the source scaled down once, in Lab, shared by all cues."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import shrink

__all__ = ['WorkingImage', 'working_scale', 'working_shape']


@dataclass(frozen=True)
class WorkingImage:
    """
    One frame at working size.

    ``lab`` is (h, w, 3) uint8 CIE L*a*b* as OpenCV stores it, ``gray`` its first channel,
    contiguous.
    """

    stamp_ns: int
    lab: NDArray[np.uint8]
    gray: NDArray[np.uint8]

    @classmethod
    def of(cls, image: NDArray[np.uint8], stamp_ns: int, shape: tuple[int, int]) -> WorkingImage:
        """
        Scale and convert a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param shape: (h, w) of the working image.
        """
        lab = cv2.cvtColor(shrink(image, shape), cv2.COLOR_BGR2Lab)
        return cls(stamp_ns, lab, np.ascontiguousarray(lab[:, :, 0]))


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
