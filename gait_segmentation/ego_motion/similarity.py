# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The similarity that most of some points, seen in two frames, agree on."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['camera_motion']

_LEAST_AROUND = 8
_STILL_PX = 0.2
_RANSAC_PX = 1.5
_SAMPLES = 100

_LEAST_APART = 16
"""Pixels between two corners that a motion may be estimated from."""

_MOST_TURN, _MOST_ZOOM = 0.2, 1.2
"""Largest rotation (radians) and zoom from frame to frame that are believed."""

_LEAST_AGREEING = 1 / 3
"""Share of the corners that must agree on the camera's motion; else it counts as unknown."""


def camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the similarity that most points agree on, None if they stand still or are few.

    :param before, after: (n, 2) float32, positions (x, y) of the same points in two frames.
    :returns: 2 x 3 transform of positions.
    """
    if len(before) < _LEAST_AROUND:
        return None
    shift = np.hypot(*(after - before).T)
    if np.partition(shift, len(shift) // 2)[len(shift) // 2] < _STILL_PX:
        return None
    return _similarity(before, after)


def _similarity(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the 2 x 3 similarity that most pairs of points agree on (RANSAC), least squares.

    :param before, after: (n, 2) float32, n >= 2.
    """
    transform = np.empty((2, 3))
    found = _agreed(before.astype(np.float64), after.astype(np.float64), transform)
    return transform if found else None


@njit(cache=True, nogil=True)
def _agreed(
    then: NDArray[np.float64], now: NDArray[np.float64], transform: NDArray[np.float64]
) -> bool:
    """Fill in the similarity; return whether any two points agree on one."""
    tolerance = _RANSAC_PX * _RANSAC_PX
    agree, most = _consensus(then, now, _SAMPLES, tolerance)
    for _ in range(2):
        if most < max(2, _LEAST_AGREEING * agree.size):
            return False
        a, b, x, y = _fitted(then, now, agree)
        most = _agreement(then, now, a, b, x, y, tolerance, agree)
    transform[0, 0], transform[0, 1], transform[0, 2] = a, -b, x
    transform[1, 0], transform[1, 1], transform[1, 2] = b, a, y
    return True


@njit(cache=True, nogil=True)
def _agreement(
    then: NDArray[np.float64],
    now: NDArray[np.float64],
    a: float,
    b: float,
    x: float,
    y: float,
    tolerance: float,
    agree: NDArray[np.bool_],
) -> int:
    """Mark the points that a similarity takes to where they are now; return how many."""
    count = 0
    for k in range(agree.size):
        off_x = a * then[k, 0] - b * then[k, 1] + x - now[k, 0]
        off_y = b * then[k, 0] + a * then[k, 1] + y - now[k, 1]
        agree[k] = off_x * off_x + off_y * off_y < tolerance
        count += agree[k]
    return count


@njit(cache=True, nogil=True)
def _consensus(
    then: NDArray[np.float64], now: NDArray[np.float64], samples: int, tolerance: float
) -> tuple[NDArray[np.bool_], int]:
    """Return which points agree with the best of some similarities through two of them."""
    count = then.shape[0]
    best, agree = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    most = 0
    state = np.uint32(1)
    for _ in range(samples):
        # A linear congruential generator (Numerical Recipes): the same samples in every run.
        state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
        first = int(state >> np.uint32(8)) % count
        state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
        second = int(state >> np.uint32(8)) % count
        dx, dy = then[second, 0] - then[first, 0], then[second, 1] - then[first, 1]
        square = dx * dx + dy * dy
        if square < _LEAST_APART * _LEAST_APART:
            continue
        to_x, to_y = now[second, 0] - now[first, 0], now[second, 1] - now[first, 1]
        a, b = (dx * to_x + dy * to_y) / square, (dx * to_y - dy * to_x) / square
        size = a * a + b * b
        if abs(b) > _MOST_TURN or not 1 / _MOST_ZOOM**2 < size < _MOST_ZOOM**2:
            continue
        x = now[first, 0] - a * then[first, 0] + b * then[first, 1]
        y = now[first, 1] - b * then[first, 0] - a * then[first, 1]
        agreeing = _agreement(then, now, a, b, x, y, tolerance, agree)
        if agreeing > most:
            most = agreeing
            best[:] = agree
    return best, most


@njit(cache=True, nogil=True)
def _fitted(
    then: NDArray[np.float64], now: NDArray[np.float64], use: NDArray[np.bool_]
) -> tuple[float, float, float, float]:
    """Return a, b, x, y of the least-squares similarity ((a, -b, x), (b, a, y))."""
    count = 0
    from_x = from_y = to_x = to_y = 0.0
    for k in range(use.size):
        if use[k]:
            count += 1
            from_x += then[k, 0]
            from_y += then[k, 1]
            to_x += now[k, 0]
            to_y += now[k, 1]
    from_x, from_y, to_x, to_y = from_x / count, from_y / count, to_x / count, to_y / count
    square = dot = cross = 0.0
    for k in range(use.size):
        if use[k]:
            dx, dy = then[k, 0] - from_x, then[k, 1] - from_y
            ex, ey = now[k, 0] - to_x, now[k, 1] - to_y
            square += dx * dx + dy * dy
            dot += dx * ex + dy * ey
            cross += dx * ey - dy * ex
    a, b = (dot / square, cross / square) if square > 0 else (1.0, 0.0)
    return a, b, to_x - a * from_x + b * from_y, to_y - b * from_x - a * from_y
