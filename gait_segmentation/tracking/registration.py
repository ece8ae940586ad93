# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The last tenths of a pixel between a frame and the remembered background.

Motions from frame to frame add up to a drift, and those too small to be told from noise are not
made at all; but at a strong edge a tenth of a pixel is a large difference.  The remainder is that
of Lucas and Kanade for all the surroundings at once: one step of least squares.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.images import Window

__all__ = ['remaining_shift']

_SEEN = 2.0
"""Times a pixel was seen to be compared with what is remembered of it."""

_MOST_OFF = 25.0
"""Difference in lightness from which something else is there."""

_LEAST_SQUARE = 25.0
"""Least squared gradient of a pixel that counts."""

_LEAST_PIXELS = 100
_LEAST, _MOST = 0.1, 1.0
"""Shifts in pixels that are made; a larger one is beyond what one step can tell."""


@njit(cache=True, nogil=True, fastmath=True)
def _add_up(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    people: NDArray[np.uint8],
    out: NDArray[np.float64],
) -> None:
    """Add up the normal equations of: difference = - gradient . shift."""
    seen, half = np.float32(_SEEN), np.float32(0.5)
    for row in range(1, lab.shape[0] - 1, 2):
        for col in range(1, lab.shape[1] - 1):
            if sums[row, col, 3] < seen or people[row, col] != 0:
                continue
            off = np.float32(lab[row, col, 0]) - sums[row, col, 0] / sums[row, col, 3]
            if abs(off) > _MOST_OFF:
                continue
            left, right = sums[row, col - 1], sums[row, col + 1]
            above, below = sums[row - 1, col], sums[row + 1, col]
            if min(min(left[3], right[3]), min(above[3], below[3])) < seen:
                continue
            gx = half * (right[0] / right[3] - left[0] / left[3])
            gy = half * (below[0] / below[3] - above[0] / above[3])
            if gx * gx + gy * gy < _LEAST_SQUARE:
                continue
            out[0] += gx * gx
            out[1] += gx * gy
            out[2] += gy * gy
            out[3] -= gx * off
            out[4] -= gy * off
            out[5] += 1


def remaining_shift(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    people: NDArray[np.uint8],
    windows: Sequence[Window],
) -> tuple[float, float] | None:
    """
    Return the shift (dx, dy) in pixels that takes the remembered background to a frame.

    :param sums: (h, w, 4) float32, see :class:`~.background.BackgroundModel`.
    :param lab: (h, w, 3) uint8, the frame.
    :param people: (h, w) uint8, non-zero where people may be.
    :param windows: the rows and columns to compare.
    :returns: None if they fit, or there is too little to compare.
    """
    total = np.zeros(6)
    for part in windows:
        _add_up(sums[part], lab[part], people[part], total)
    if total[5] < _LEAST_PIXELS:
        return None
    # Along a single edge nothing is known; there it stays where it is.
    prior = _LEAST_SQUARE * _LEAST_PIXELS
    matrix = np.array([[total[0] + prior, total[1]], [total[1], total[2] + prior]])
    dx, dy = np.linalg.solve(matrix, total[3:5])
    if not _LEAST < np.hypot(dx, dy) < _MOST:
        return None
    return float(dx), float(dy)
