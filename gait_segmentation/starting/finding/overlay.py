# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Earlier frames laid onto the newest one: moved, shifted until they fit, and as bright."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.warping import warp_window

__all__ = ['exposed_alike', 'laid', 'misplaced', 'warped']

_ROUNDS, _CUT = 3, 20.0
"""Steps of Gauss and Newton, and the largest difference that they regard, in grey levels."""

_LEAST_PIXELS = 200
_MOST_PX = 2.5

_LEAST_GAIN = 0.01
"""Least change of the exposure that is undone."""


def laid(
    mask: NDArray[np.uint8], motion: NDArray[np.float64], window: Window
) -> NDArray[np.uint8]:
    """Return a small mask in a window of the newest frame, (h, w) uint8 0/255."""
    laid = warp_window(mask, motion, window, cv2.BORDER_CONSTANT)
    return np.asarray(cv2.inRange(laid, 1, 255))


def warped(
    image: NDArray[np.uint8], motion: NDArray[np.float64], window: Window
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a frame moved onto the newest one in a window, and 255 where it shows nothing."""
    part = warp_window(image, motion, window)
    full = np.full(image.shape[:2], 255, np.uint8)
    inside = warp_window(full, motion, window, cv2.BORDER_CONSTANT)
    return part, np.asarray(cv2.inRange(inside, 0, 254))


def exposed_alike(
    then: NDArray[np.uint8], now: NDArray[np.uint8], hidden: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Return an earlier frame as bright as the newest one."""
    use = cv2.bitwise_not(hidden)
    if cv2.countNonZero(use) < _LEAST_PIXELS:
        return then
    gain = sum(cv2.mean(now, use)[:3]) / max(sum(cv2.mean(then, use)[:3]), 1.0)
    return then if abs(gain - 1) < _LEAST_GAIN else cv2.convertScaleAbs(then, alpha=gain)


def misplaced(
    now: NDArray[np.uint8], then: NDArray[np.uint8], hidden: NDArray[np.uint8]
) -> tuple[float, float]:
    """Return by how much an earlier frame must yet be moved, by steps of Gauss and Newton."""
    a = cv2.GaussianBlur(cv2.cvtColor(now, cv2.COLOR_BGR2GRAY), (0, 0), 1.0).astype(np.float32)
    b = cv2.GaussianBlur(cv2.cvtColor(then, cv2.COLOR_BGR2GRAY), (0, 0), 1.0).astype(np.float32)
    gx = cv2.Sobel(b, cv2.CV_32F, 1, 0, ksize=1) / 2
    gy = cv2.Sobel(b, cv2.CV_32F, 0, 1, ksize=1) / 2
    x, y = 0.0, 0.0
    size = (b.shape[1], b.shape[0])
    for _ in range(_ROUNDS):
        shift = np.array([[1.0, 0, x], [0, 1.0, y]])
        rest = a - cv2.warpAffine(b, shift, size, borderMode=cv2.BORDER_REPLICATE)
        use = (hidden == 0) & (np.abs(rest) < _CUT)
        if np.count_nonzero(use) < _LEAST_PIXELS:
            return 0.0, 0.0
        u, v, r = -gx[use], -gy[use], rest[use]
        xx, xy, yy = float(u @ u), float(u @ v), float(v @ v)
        determinant = xx * yy - xy * xy
        if determinant <= 1e-3 * (xx + yy) ** 2:
            # Nothing tells the shift along an edge, nor any where there is none.
            break
        bx, by = float(u @ r), float(v @ r)
        x += (yy * bx - xy * by) / determinant
        y += (xx * by - xy * bx) / determinant
    if np.hypot(x, y) > _MOST_PX:
        return 0.0, 0.0
    return x, y
