# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Likelihoods on the pixel grid of templates, and templates on that of the likelihood."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box, pixel_affine, reach, template_to_image
from gait_segmentation.images import Window

__all__ = ['antialiasing_side', 'inside', 'region', 'smoothed', 'warp_template']

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


def warp_template(
    template: NDArray[np.uint8], body: BodyFrame, fill: float, shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """
    Warp a template to where a body stands.

    Interpolates linearly; where the template shrinks it is averaged over the pixels' areas.

    :param template: (H, W) uint8.
    :param body: where the body stands, in the image's pixels.
    :param fill: share of the template's rows the body takes.
    :param shape: (h, w) of the image.
    :returns: (h, w) uint8, 255 inside, soft edge.
    """
    result = np.zeros(shape, np.uint8)
    height, width = template.shape
    transform = template_to_image(body, height, width, fill)
    left, top, right, bottom = reach(transform, width, height)
    rows, columns = Box(left, top, right - left, bottom - top).slices(shape[1], shape[0])
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if min(size) == 0:
        return result
    finer = max(1, math.ceil(fill * height / body.height - 0.25))
    transform[:, 2] -= columns.start, rows.start
    matrix = pixel_affine(finer * transform)
    warped = cv2.warpAffine(
        template, matrix, (size[0] * finer, size[1] * finer), flags=cv2.INTER_LINEAR
    )
    if finer > 1:
        warped = cv2.resize(warped, size, interpolation=cv2.INTER_AREA)
    result[rows, columns] = warped
    return result
