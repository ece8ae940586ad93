# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far pixels lie from the outline of a mask, where that matters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, bounding_box, signed_distance

__all__ = ['REACH', 'Nearness', 'by_distance', 'nearness']

REACH = 0.12
"""How far outside of a mask distances are told, in body heights: no cue reaches farther."""


@dataclass(frozen=True)
class Nearness:
    """
    Distances to the outline of a mask in pixels.

    ``part`` is the part of a window outside of which all pixels are farther than :data:`REACH`
    from the mask.  ``distance`` is (h, w) float32, positive on the mask and negative elsewhere.
    """

    part: Window
    distance: NDArray[np.float32]


def nearness(mask: NDArray[np.uint8], height: float) -> Nearness | None:
    """
    Return how near pixels are to a mask, None if it is empty.

    :param mask: (h, w) uint8, above 127 inside.
    :param height: of the body in pixels.
    """
    left, top, across, down = bounding_box(mask)
    if across == 0:
        return None
    margin = math.ceil(REACH * height) + 1
    part = (
        slice(max(top - margin, 0), min(top + down + margin, mask.shape[0])),
        slice(max(left - margin, 0), min(left + across + margin, mask.shape[1])),
    )
    return Nearness(part, signed_distance(mask[part] > 127))


def by_distance(
    near: Nearness | None, shape: tuple[int, ...], slope: float, low: float, high: float
) -> NDArray[np.float32]:
    """
    Return the distance to an outline times a slope, within limits, (h, w) float32.

    :param near: how near the pixels of a window are, None if all are far; where that is not
        known they are so far outside that it is the lower limit.
    :param shape: (h, w) of the window.
    """
    out = np.full(shape, low, np.float32)
    if near is not None:
        out[near.part] = np.clip(np.float32(slope) * near.distance, low, high)
    return out
