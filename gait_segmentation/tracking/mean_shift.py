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

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['WindowShift', 'mean_shift']

_ITERATIONS = 10
_DONE_PX = 0.25


@dataclass(frozen=True)
class WindowShift:
    """
    Where the weights went relative to the reference.

    ``dx, dy`` are in pixels, ``scale`` is the ratio of sizes (square root of the mass's ratio).
    """

    dx: float
    dy: float
    scale: float


def mean_shift(
    weights: NDArray[np.uint8],
    reference: NDArray[np.uint8],
    window: tuple[int, int, int, int],
) -> WindowShift:
    """
    Move a window over the weights until its centroid lies as in the reference.

    :param weights: (h, w) uint8, e.g. the likelihood image.
    :param reference: (h, w) uint8, what the person looked like before.
    :param window: (x, y, width, height) of the window in pixels, where the reference's person is.
    :returns: the shift; zero if weights or reference are empty in the window.
    """
    weights, reference = np.ascontiguousarray(weights), np.ascontiguousarray(reference)
    return WindowShift(*_shift(weights, reference, *window))


@kernel('u1[:,::1], u1[:,::1], i8, i8, i8, i8')
def _shift(
    weights: NDArray[np.uint8],
    reference: NDArray[np.uint8],
    x: int,
    y: int,
    width: int,
    height: int,
) -> tuple[float, float, float]:
    """Return how far the window goes, and the ratio of sizes."""
    mass, center_x, center_y = _moments(reference, x, y, width, height)
    if mass <= 0:
        return 0.0, 0.0, 1.0
    off_x, off_y = center_x - x, center_y - y
    at_x, at_y = float(x), float(y)
    found = 0.0
    for _ in range(_ITERATIONS):
        left, top = int(np.rint(at_x)), int(np.rint(at_y))
        found, center_x, center_y = _moments(weights, left, top, width, height)
        if found <= 0:
            return 0.0, 0.0, 1.0
        step_x = center_x - off_x - at_x
        step_y = center_y - off_y - at_y
        at_x += step_x
        at_y += step_y
        if abs(step_x) < _DONE_PX and abs(step_y) < _DONE_PX:
            break
    return at_x - x, at_y - y, math.sqrt(found / mass)


@njit(nogil=True)
def _moments(
    weights: NDArray[np.uint8], x: int, y: int, width: int, height: int
) -> tuple[float, float, float]:
    """Return mass and centroid of the weights in a window clipped to the image."""
    left, top = max(x, 0), max(y, 0)
    right, bottom = min(x + width, weights.shape[1]), min(y + height, weights.shape[0])
    mass, across, down = 0, 0, 0
    for row in range(top, bottom):
        line = weights[row]
        of_row, by_column = np.int32(0), np.int32(0)
        for col in range(left, right):
            value = np.int32(line[col])
            of_row += value
            by_column += value * np.int32(col - left)
        mass += of_row
        across += by_column + left * of_row
        down += row * of_row
    if mass <= 0:
        return 0.0, 0.0, 0.0
    return float(mass), across / mass + 0.5, down / mass + 0.5
