# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Mean shift with scale on a likelihood image (Comaniciu, Ramesh and Meer 2003; Bradski 1998).

With the flat kernel the mean shift moves a window to the centroid of the weights in it.  A
walker's centroid is not the centre of the window and its mass depends on the build, so both are
compared with those of a reference: the mask the person had last.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box

__all__ = ['WindowShift', 'mean_shift']

_ITERATIONS = 10
_DONE_PX = 0.25


@dataclass(frozen=True)
class WindowShift:
    """
    Where the weights went relative to the reference.

    ``dx, dy`` are in pixels, ``scale`` is the ratio of sizes (square root of the mass's ratio).
    """

    dx: float = 0.0
    dy: float = 0.0
    scale: float = 1.0


def mean_shift(
    weights: NDArray[np.uint8], reference: NDArray[np.uint8], window: Box
) -> WindowShift:
    """
    Move a window over the weights until its centroid lies as in the reference.

    :param weights: (h, w) uint8, e.g. the likelihood image.
    :param reference: (h, w) uint8, what the person looked like before.
    :param window: where the reference's person is, in pixels.
    :returns: the shift; zero if weights or reference are empty in the window.
    """
    mass, from_x, from_y = _moments(reference, window)
    found, dx, dy = 0.0, 0.0, 0.0
    for _ in range(_ITERATIONS if mass else 0):
        found, x, y = _moments(weights, window.shifted(dx, dy))
        if not found:
            break
        step_x, step_y = x - from_x - dx, y - from_y - dy
        dx, dy = dx + step_x, dy + step_y
        if max(abs(step_x), abs(step_y)) < _DONE_PX:
            break
    return WindowShift(dx, dy, math.sqrt(found / mass)) if found else WindowShift()


def _moments(weights: NDArray[np.uint8], window: Box) -> tuple[float, float, float]:
    """Return mass and centroid of the weights in a window clipped to the image."""
    left, top = max(round(window.x), 0), max(round(window.y), 0)
    right, bottom = round(window.x) + round(window.width), round(window.y) + round(window.height)
    part = weights[top : max(bottom, 0), left : max(right, 0)]
    moments = cv2.moments(part) if part.size else {'m00': 0.0}
    if not moments['m00']:
        return 0.0, 0.0, 0.0
    mass = moments['m00']
    return mass, left + moments['m10'] / mass, top + moments['m01'] / mass
