# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Weaker evidence beside colour: what moves with the body, and where the last mask was."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.nearness import Nearness, by_distance
from gait_segmentation.warping import warp_window

__all__ = ['add_motion', 'add_propagation']

_RESIDUAL_CUT = 30
_RESIDUAL_SIGMA = 12.0
_RESIDUAL_LIMIT = 2.0
_PROPAGATION_SLOPE = 0.02
_PROPAGATION_LIMIT = 3.0


@njit(nogil=True, inline='always')
def _mirrored(place: int, size: int) -> int:
    """Return where a place is that is at most one pixel outside of a line."""
    if size == 1:
        return 0
    return -place if place < 0 else min(place, 2 * size - 2 - place)


@kernel('u1[:,::1], i8, i8, u1[:,::1], u1[:,::1], f8, f4[:,::1], f4[:,::1]')
def _add_difference(
    gray: NDArray[np.uint8],
    top: int,
    left: int,
    stays: NDArray[np.uint8],
    moves: NDArray[np.uint8],
    weight: float,
    logit: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """
    Fill in what it says how well two pictures explain a window, and add it times the weight.

    What a picture does not explain is the mean difference over 3 x 3 pixels, rounded.
    """
    scale = np.float32(1 / (2 * _RESIDUAL_SIGMA * _RESIDUAL_SIGMA))
    limit, gain, cut = np.float32(_RESIDUAL_LIMIT), np.float32(weight), np.float32(_RESIDUAL_CUT)
    share, half = np.float32(1 / 9), np.float32(0.5)
    height, width = out.shape
    sums = np.empty((2, width + 2), np.float32)
    for row in range(height):
        above, below = _mirrored(row - 1, height), _mirrored(row + 1, height)
        for picture in range(2):
            then, columns = moves if picture else stays, sums[picture]
            a, b, c = then[above], then[row], then[below]
            d = gray[top + above, left : left + width]
            e = gray[top + row, left : left + width]
            f = gray[top + below, left : left + width]
            for col in range(width):
                columns[col + 1] = (
                    abs(np.float32(d[col]) - np.float32(a[col]))
                    + abs(np.float32(e[col]) - np.float32(b[col]))
                    + abs(np.float32(f[col]) - np.float32(c[col]))
                )
            columns[0] = columns[_mirrored(-1, width) + 1]
            columns[width + 1] = columns[_mirrored(width, width) + 1]
        staying, moving = sums[0], sums[1]
        evidence, line = out[row], logit[row]
        for col in range(width):
            stay = share * (staying[col] + staying[col + 1] + staying[col + 2]) + half
            move = share * (moving[col] + moving[col + 1] + moving[col + 2]) + half
            stay = min(np.float32(np.int32(stay)), cut)
            move = min(np.float32(np.int32(move)), cut)
            value = scale * (stay * stay - move * move)
            value = min(max(value, -limit), limit)
            evidence[col] = value
            line[col] += gain * value


def add_motion(
    logit: NDArray[np.float32],
    gray: NDArray[np.uint8],
    earlier: NDArray[np.uint8],
    motion: WorldMotion,
    body: NDArray[np.float64],
    window: Window,
    weight: float,
) -> NDArray[np.float32]:
    """
    Add the evidence that pixels move with the body rather than stay with the world.

    An earlier frame is carried to this one twice, with the world and with the body; a pixel
    belongs to the one that explains it better.  Limited to +-2 times the weight.

    :param logit: (h, w) float32 of the window, changed.
    :param gray: (H, W) uint8 brightness of this frame.
    :param earlier: (H, W) uint8, that of a frame some frames back.
    :param motion: of the still world from then to now.
    :param body: 2 x 3 transform of positions on the body, likewise.
    :param window: the window's rows and columns.
    :returns: the evidence itself, (h, w) float32 within +-2.
    """
    stays = motion.warped(earlier, window)
    moves = warp_window(earlier, body, window)
    evidence = np.empty(logit.shape, np.float32)
    top, left = window[0].start, window[1].start
    _add_difference(gray, top, left, stays, moves, weight, logit, evidence)
    return evidence


def add_propagation(
    logit: NDArray[np.float32], near: Nearness | None, height: float, weight: float
) -> None:
    """
    Add the weak prior from the last mask; limited to +-3 times the weight.

    :param logit: (h, w) float32 of a window, changed.
    :param near: how near its pixels are to the last mask carried to this frame, None if nothing
        of that is in the window.
    :param height: height of the body in pixels.
    """
    limit = weight * _PROPAGATION_LIMIT
    logit += by_distance(near, logit.shape, weight / (_PROPAGATION_SLOPE * height), -limit, limit)
