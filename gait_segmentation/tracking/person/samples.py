# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels about a mask are learnt as person and which as surroundings."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import distance_from

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
    if template is not None:
        body = template > 127
        if body.any():
            inside &= distance_from(body) < guard
        if familiar is not None:
            inside &= body | ~familiar
    return inside, outside
