# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The similarity that most of some points, seen in two frames, agree on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.sampling import FIRST, pair_of
from gait_segmentation.kernels import kernel

__all__ = ['camera_motion']

_LEAST_POINTS = 8
_STILL_PX = 0.2
"""Points that are needed, and the median shift up to which they stand still."""
_REACH_PX = 1.5
"""How far off a point may be that still counts, though next to nothing."""

_SAMPLES, _ROUNDS = 100, 5
"""Pairs of points tried, and rounds of fitting to those that agree with the best one."""

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
    if len(before) < _LEAST_POINTS:
        return None
    shift = np.hypot(*(after - before).T)
    if np.partition(shift, len(shift) // 2)[len(shift) // 2] < _STILL_PX:
        return None
    return _similarity(before, after)


def _similarity(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the 2 x 3 similarity that points agree on best, by samples of two (RANSAC).

    :param before, after: (n, 2) float32, n >= 2.
    """
    transform = np.empty((2, 3))
    found = _agreed(before.astype(np.float64), after.astype(np.float64), transform)
    return transform if found else None


@kernel('f8[:,::1], f8[:,::1], f8[:,::1]')
def _agreed(
    then: NDArray[np.float64], now: NDArray[np.float64], transform: NDArray[np.float64]
) -> bool:
    """Fill in the similarity; return whether any two points agree on one."""
    weights = _consensus(then, now, _SAMPLES)
    for _ in range(_ROUNDS):
        if np.count_nonzero(weights) < max(2, _LEAST_AGREEING * weights.size):
            return False
        a, b, x, y = _fitted(then, now, weights)
        _weigh(then, now, a, b, x, y, weights)
    transform[0, 0], transform[0, 1], transform[0, 2] = a, -b, x
    transform[1, 0], transform[1, 1], transform[1, 2] = b, a, y
    return True


@kernel()
def _weigh(
    then: NDArray[np.float64],
    now: NDArray[np.float64],
    a: float,
    b: float,
    x: float,
    y: float,
    weights: NDArray[np.float64],
) -> float:
    """
    Fill in how well a similarity takes each point to where it is now, 1 to 0; return the sum.

    Were all within reach worth the same, points on slow walkers would pull the world along.
    """
    total = 0.0
    for k in range(weights.size):
        off_x = a * then[k, 0] - b * then[k, 1] + x - now[k, 0]
        off_y = b * then[k, 0] + a * then[k, 1] + y - now[k, 1]
        weights[k] = max(1 - (off_x * off_x + off_y * off_y) / (_REACH_PX * _REACH_PX), 0.0)
        total += weights[k]
    return total


@kernel()
def _consensus(
    then: NDArray[np.float64], now: NDArray[np.float64], samples: int
) -> NDArray[np.float64]:
    """Return the weights of the points by the best of some similarities through two of them."""
    count = then.shape[0]
    best, weights = np.zeros(count), np.zeros(count)
    most = 0.0
    state = FIRST
    for _ in range(samples):
        first, second, state = pair_of(count, state)
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
        total = _weigh(then, now, a, b, x, y, weights)
        if total > most:
            most = total
            best[:] = weights
    return best


@kernel()
def _fitted(
    then: NDArray[np.float64], now: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """Return a, b, x, y of the weighted least-squares similarity ((a, -b, x), (b, a, y))."""
    total = from_x = from_y = to_x = to_y = 0.0
    for k in range(weights.size):
        total += weights[k]
        from_x += weights[k] * then[k, 0]
        from_y += weights[k] * then[k, 1]
        to_x += weights[k] * now[k, 0]
        to_y += weights[k] * now[k, 1]
    from_x, from_y, to_x, to_y = from_x / total, from_y / total, to_x / total, to_y / total
    square = dot = cross = 0.0
    for k in range(weights.size):
        dx, dy = then[k, 0] - from_x, then[k, 1] - from_y
        ex, ey = now[k, 0] - to_x, now[k, 1] - to_y
        square += weights[k] * (dx * dx + dy * dy)
        dot += weights[k] * (dx * ex + dy * ey)
        cross += weights[k] * (dx * ey - dy * ex)
    a, b = (dot / square, cross / square) if square > 0 else (1.0, 0.0)
    return a, b, to_x - a * from_x + b * from_y, to_y - b * from_x - a * from_y
