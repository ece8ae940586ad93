# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a mask that came back is fit to be learnt from."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Bounds, Window, bounding_box, count_likely
from gait_segmentation.results import Feedback
from gait_segmentation.sizes import shrink
from gait_segmentation.tracking.person.person import Person

__all__ = ['MARGIN', 'WHOLE', 'WholeArea', 'grown', 'working_masks']

MARGIN = 0.02
"""How far a mask may be off, in body heights: so far about it no background is learnt."""

WHOLE = 0.75
"""Share of the usual area from which a mask shows all of the person, and so is followed."""

_AREA_RATE = 0.02
"""
Share by which the usual area moves towards that of a mask: of one of all of the person or not, or
nothing would be learnt after a first mask that was far too large.
"""


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
    size = 2 * max(1, round(MARGIN * height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    x, y, width, tall = bounding_box(mask) if bounds is None else bounds
    part = (
        slice(max(y - size, 0), min(y + tall + size, mask.shape[0])),
        slice(max(x - size, 0), min(x + width + size, mask.shape[1])),
    )
    return part, np.asarray(cv2.dilate(mask[part], kernel))


class WholeArea:
    """How large the masks of a person usually are, for the height."""

    def __init__(self, person: Person) -> None:
        """Begin with the person's mask."""
        self._usual = _area(person.mask, person)

    def update(self, mask: NDArray[np.uint8], person: Person) -> bool:
        """
        Get used to the size of a mask.

        :param mask: (h, w) uint8.
        :returns: whether it was as large as usual; else it shows only part of the person.
        """
        area = _area(mask, person)
        share = area / max(self._usual, 1e-6)
        self._usual += _AREA_RATE * (area - self._usual)
        return share >= WHOLE


def _area(mask: NDArray[np.uint8], person: Person) -> float:
    """Return the area of a mask in squared body heights, made up for what is outside."""
    inside = max(person.share_inside(mask.shape), 0.1)
    return count_likely(mask) / (inside * person.height**2)
