# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of images, and making them smaller; for who must not wait for kernels to be loaded."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['same_proportions', 'shrink']


def same_proportions(shape: tuple[int, ...], source: tuple[int, ...]) -> bool:
    """
    Tell whether one size can be another one scaled, to a pixel.

    :param shape: (h, w).
    :param source: (H, W).
    """
    lowest = max((size - 1) / whole for size, whole in zip(shape, source, strict=True))
    highest = min((size + 1) / whole for size, whole in zip(shape, source, strict=True))
    return lowest <= highest


def shrink(image: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Return an image at a smaller size, without aliasing.

    It is halved by averaging 2 x 2 pixels, which OpenCV does far faster than any other area, as
    often as that leaves it large enough, and interpolated for the rest.

    :param image: (H, W) or (H, W, 3) uint8.
    :param shape: (h, w) of the result.
    """
    while image.shape[0] >= 2 * shape[0] and image.shape[1] >= 2 * shape[1]:
        half = (image.shape[1] // 2, image.shape[0] // 2)
        whole = image[: 2 * half[1], : 2 * half[0]]
        image = np.asarray(cv2.resize(whole, half, interpolation=cv2.INTER_AREA))
    if image.shape[:2] != shape:
        image = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_LINEAR)
    return image
