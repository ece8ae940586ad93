# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels about a mask are learnt as person and which as surroundings."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Bounds, count_likely
from gait_segmentation.kernels import kernel

__all__ = ['samples']


def samples(
    mask: NDArray[np.uint8],
    template: NDArray[np.uint8] | None,
    strange: NDArray[np.uint8] | None,
    guard: float,
    familiar: NDArray[np.bool_] | None = None,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """
    Return which pixels of a window show the person, and which the surroundings.

    The person's are those of the mask near the template, outside of which they must not look as
    the surroundings do there, or as a shadow on them: a mask that takes in the shadow at the feet
    would teach that it is the person's, and take in more of it.  The surroundings' are those that
    do not touch the mask and are not known to be something else.

    :param mask: (h, w) uint8, above 127 on the person.
    :param template: (h, w) uint8, above 127 on the body; None or without a body, all of the mask
        is the person's.
    :param strange: (h, w) uint8, non-zero where the surroundings are known to look otherwise.
    :param guard: distance from the template in pixels up to which a pixel is near.
    :param familiar: (h, w) bool, where the surroundings are known to look like this.
    """
    inside, outside = np.empty(mask.shape, np.bool_), np.empty(mask.shape, np.bool_)
    bounds = _part(np.ascontiguousarray(mask), inside, outside)
    if strange is not None:
        outside &= strange == 0
    if template is not None:
        _keep_near(inside, bounds, template, guard)
        if familiar is not None:
            inside &= ~(familiar & (template <= 127))
    return inside, outside


@kernel('u1[:,::1], b1[:,::1], b1[:,::1]')
def _part(
    mask: NDArray[np.uint8], inside: NDArray[np.bool_], outside: NDArray[np.bool_]
) -> Bounds:
    """Fill in where the mask is, and where none of 3 x 3 pixels is in it; return its bounds."""
    height, width = mask.shape
    columns, every = np.zeros(width + 2, np.uint8), np.zeros(width, np.uint8)
    top, bottom = height, 0
    for row in range(height):
        above, here, below = mask[max(row - 1, 0)], mask[row], mask[min(row + 1, height - 1)]
        is_inside, is_outside = inside[row], outside[row]
        some = np.uint8(0)
        for col in range(width):
            is_inside[col] = here[col] > 127
            columns[col + 1] = above[col] | here[col] | below[col]
            every[col] |= here[col]
            some |= here[col]
        for col in range(width):
            is_outside[col] = (columns[col] | columns[col + 1] | columns[col + 2]) <= 127
        if some > 127:
            top, bottom = min(top, row), row + 1
    if bottom == 0:
        return 0, 0, 0, 0
    left, right = 0, width
    while every[left] <= 127:
        left += 1
    while every[right - 1] <= 127:
        right -= 1
    return left, top, right - left, bottom - top


def _keep_near(
    inside: NDArray[np.bool_],
    bounds: Bounds,
    template: NDArray[np.uint8],
    guard: float,
) -> None:
    """Take out what lies far outside of the template, unless there is none."""
    x, y, width, height = bounds
    if width == 0:
        return
    reach = math.ceil(guard) + 1
    top, left = max(y - reach, 0), max(x - reach, 0)
    outside = cv2.inRange(template[top : y + height + reach, left : x + width + reach], 0, 127)
    if outside.size == cv2.countNonZero(outside):
        if count_likely(template):
            inside[:] = False
    else:
        away = cv2.distanceTransform(outside, cv2.DIST_L2, 3)
        away = away[y - top : y - top + height, x - left : x - left + width]
        inside[y : y + height, x : x + width] &= away < guard
