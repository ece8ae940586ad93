# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The last tenths of a pixel between a frame and the remembered background.

Motions from frame to frame add up to a drift, and those too small to be told from noise are not
made at all; but at a strong edge a tenth of a pixel is a large difference.  The remainder is that
of Lucas and Kanade for all the surroundings at once: one step of least squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.background.kernels import SURE_COUNT, lightness_of_row

__all__ = ['remaining_shift']

_MOST_OFF = 25.0
"""Difference in lightness from which something else is there."""

_LEAST_SQUARE = 25.0
"""Least squared gradient of a pixel that counts."""

_LEAST_PIXELS = 100
_LEAST, _MOST = 0.1, 1.0
"""Shifts in pixels that are made; a larger one is beyond what one step can tell."""


@kernel(
    'f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8, f8[::1]',
    fastmath=True,
    error_model='numpy',
)
def _add_up(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    people: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    out: NDArray[np.float64],
) -> None:
    """Add up, in every second row, the normal equations of: difference = - gradient . shift."""
    half, zero = np.float32(0.5), np.float32(0)
    most, least = np.float32(_MOST_OFF), np.float32(_LEAST_SQUARE)
    columns = right - left
    if min(bottom - top, columns) < 3:
        return
    # Of three rows: one above, this one, and one below, which is the next one's above.
    means, known = np.empty((3, columns), np.float32), np.empty((3, columns), np.float32)
    span = slice(4 * left, 4 * right)
    first, last = 0, 2
    lightness_of_row(sums[top].reshape(-1)[span], SURE_COUNT, means[last], known[last])
    for row in range(top + 1, bottom - 1, 2):
        first, last = last, first
        lightness_of_row(sums[row].reshape(-1)[span], SURE_COUNT, means[1], known[1])
        lightness_of_row(sums[row + 1].reshape(-1)[span], SURE_COUNT, means[last], known[last])
        pixels = lab[row].reshape(-1)[3 * left : 3 * right]
        hidden = people[row, left:right]
        above, here, below = means[first], means[1], means[last]
        over, sure, under = known[first], known[1], known[last]
        xx = xy = yy = bx = by = used = zero
        for col in range(1, columns - 1):
            off = np.float32(pixels[3 * col]) - here[col]
            gx, gy = half * (here[col + 1] - here[col - 1]), half * (below[col] - above[col])
            use = over[col] * under[col] * sure[col] * sure[col - 1] * sure[col + 1]
            far = (abs(off) > most) | (gx * gx + gy * gy < least) | (hidden[col] != 0)
            use = zero if far else use
            xx += use * gx * gx
            xy += use * gx * gy
            yy += use * gy * gy
            bx -= use * gx * off
            by -= use * gy * off
            used += use
        out[0] += xx
        out[1] += xy
        out[2] += yy
        out[3] += bx
        out[4] += by
        out[5] += used


def remaining_shift(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    people: NDArray[np.uint8],
    windows: Sequence[Window],
) -> tuple[float, float] | None:
    """
    Return the shift (dx, dy) in pixels that takes the remembered background to a frame.

    :param sums: (h, w, 4) float32, see :class:`~.model.BackgroundModel`.
    :param lab: (h, w, 3) uint8, the frame.
    :param people: (h, w) uint8, non-zero where people may be.
    :param windows: the rows and columns to compare.
    :returns: None if they fit, or there is too little to compare.
    """
    total = np.zeros(6)
    for rows, columns in windows:
        _add_up(sums, lab, people, rows.start, rows.stop, columns.start, columns.stop, total)
    if total[5] < _LEAST_PIXELS:
        return None
    # Along a single edge nothing is known; there it stays where it is.
    prior = _LEAST_SQUARE * _LEAST_PIXELS
    xx, xy, yy, x, y, _ = total.tolist()
    xx, yy = xx + prior, yy + prior
    scale = 1 / (xx * yy - xy * xy)
    dx, dy = scale * (yy * x - xy * y), scale * (xx * y - xy * x)
    if not _LEAST < math.hypot(dx, dy) < _MOST:
        return None
    return dx, dy
