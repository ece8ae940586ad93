# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The masks that come back: at working size, with a margin, and without what is apart."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import (
    Bounds,
    Window,
    bounding_box,
    shrink,
)
from gait_segmentation.results import Feedback

_MARGIN = 0.02
"""How far a mask may be off, in body heights: so far about it no background is learnt."""


def working_masks(
    feedback: Feedback, shape: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return mask (0/255) and template at working size, (h, w) uint8, for the tracker alone."""
    mask, prior = feedback.mask, feedback.shape_prior
    # They are kept, and who else has them may draw on them.
    if mask.shape == shape:
        mask = mask.copy()
    else:
        mask = np.asarray(cv2.threshold(shrink(mask, shape), 127, 255, cv2.THRESH_BINARY)[1])
    if prior.shape == shape:
        return mask, prior.copy()
    return mask, np.asarray(cv2.resize(prior, shape[::-1], interpolation=cv2.INTER_LINEAR))


def grown(
    mask: NDArray[np.uint8], height: float, bounds: Bounds | None = None
) -> tuple[Window, NDArray[np.uint8]]:
    """
    Return a mask with a margin, where the person may be: a window and what is in it.

    :param mask: (h, w) uint8.
    :param height: of the body in pixels.
    :param bounds: of the mask, if they are known.
    """
    size = 2 * max(1, round(_MARGIN * height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    x, y, width, tall = bounding_box(mask) if bounds is None else bounds
    part = (
        slice(max(y - size, 0), min(y + tall + size, mask.shape[0])),
        slice(max(x - size, 0), min(x + width + size, mask.shape[1])),
    )
    return part, np.asarray(cv2.dilate(mask[part], kernel))
