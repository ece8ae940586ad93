# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels about a mask are learnt as person and which as surroundings."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Bounds, bounding_box, count_likely

__all__ = ['samples']


def samples(
    mask: NDArray[np.uint8],
    template: NDArray[np.uint8] | None,
    guard: float,
    familiar: NDArray[np.bool_] | None = None,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """
    Return which pixels of a window show the person, and which the surroundings.

    The person's are those of the mask near the template, outside of which they must not look as
    the surroundings do there, or as a shadow on them: a mask that takes in the shadow at the feet
    would teach that it is the person's, and take in more of it.  The surroundings' are those that
    do not touch the mask.

    :param mask: (h, w) uint8 0/255, the person.
    :param template: (h, w) uint8, above 127 on the body; None or without a body, all of the mask
        is the person's.
    :param guard: distance from the template in pixels up to which a pixel is near.
    :param familiar: (h, w) bool, where the surroundings are known to look like this.
    """
    inside, outside = mask > 127, cv2.dilate(mask, np.ones((3, 3), np.uint8)) <= 127
    bounds = bounding_box(mask)
    if template is not None:
        _keep_near(inside, bounds, template, guard)
        if familiar is not None:
            inside &= ~(familiar & (template <= 127))
    return inside, outside


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
