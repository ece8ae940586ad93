# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a likelihood on another pixel grid: which part of it, and how smooth it must be."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import Window

__all__ = ['antialiasing_side', 'inside', 'region', 'smoothed']

_ALL = 255


def antialiasing_side(pitch: float) -> int:
    """
    Return the odd side of the box filter, in pixels, after which nothing aliases.

    :param pitch: distance of the samples in pixels of the image, above 0; up to 1 the side is 1.
    """
    return 2 * math.ceil(pitch / 2 - 0.75) + 1


def inside(
    sides: tuple[float, float, float, float], shape: tuple[int, ...], margin: float = 0.0
) -> bool:
    """
    Tell whether what lies between sides is in an image.

    :param sides: left, top, right and bottom.
    :param shape: (h, w) of the image.
    :param margin: pixels that must be left beyond the sides; linear interpolation needs a half.
    """
    left, top, right, bottom = sides
    return min(left, top) >= margin and right <= shape[1] - margin and bottom <= shape[0] - margin


def smoothed(
    likelihood: NDArray[np.uint8],
    known: NDArray[np.uint8] | None,
    window: Window,
    side: int,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """
    Average a likelihood over what is known of it.

    :param likelihood: (h, w) uint8.
    :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
    :param window: the rows and columns that are wanted.
    :param side: of the square whose mean is taken.
    :returns: the means in the window, and the same with 255 where the likelihood is known, else
        0; None = known everywhere.
    """
    values = likelihood[window]
    seen = None if known is None else np.where(known[window] != 0, _ALL, 0).astype(np.uint8)
    if values.size == 0:
        # OpenCV makes no arrays without pixels.
        return values, seen
    if seen is not None:
        values = cv2.bitwise_and(values, seen)
    if side > 1:
        values = cv2.blur(values, (side, side), borderType=cv2.BORDER_REPLICATE)
        if seen is not None:
            share = cv2.blur(seen, (side, side), borderType=cv2.BORDER_REPLICATE)
            values = cv2.divide(values, share, scale=_ALL)
    return values, seen


def region(
    sides: tuple[float, float, float, float], shape: tuple[int, ...], margin: int
) -> Window:
    """Return the part of an image that can matter between sides, with a margin to be blurred."""
    left, top, right, bottom = sides
    box = Box(left, top, right - left, bottom - top).padded(margin + 1, margin + 1)
    return box.slices(shape[1], shape[0])
