# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Images warped by motions of the camera."""

from __future__ import annotations

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import pixel_affine
from gait_segmentation.images import Window

__all__ = ['warp_window']


_STILL = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]

_Pixel = TypeVar('_Pixel', np.uint8, np.float32)


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
    if inside and motion.tolist() == _STILL:
        return image[window].copy()
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if min(size) <= 0:
        # OpenCV would take the image's size.
        return np.empty((max(size[1], 0), max(size[0], 0), *image.shape[2:]), image.dtype)
    matrix = pixel_affine(motion)
    matrix[:, 2] -= (columns.start, rows.start)
    return np.asarray(cv2.warpAffine(image, matrix, size, flags=interpolation, borderMode=border))
