# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Images warped by motions of the camera."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import pixel_affine
from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel

__all__ = ['warp_window']

_STILL = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]

_RUN, _MOST_BEND = 64, 1 / 128
"""Pixels warped at once, and the largest turn or change of scale for which that pays."""


def warp_window(
    image: NDArray[np.uint8],
    motion: NDArray[np.float64],
    window: Window,
    border: int = cv2.BORDER_REPLICATE,
) -> NDArray[np.uint8]:
    """
    Warp an image by a transform of positions and return a window of the result.

    :param image: (H, W) or (H, W, C) uint8.
    :param motion: 2 x 3 transform of positions from the image to the result.
    :param window: the rows and columns to compute.
    :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
    """
    rows, columns = window
    inside = rows.stop <= image.shape[0] and columns.stop <= image.shape[1]
    values = motion.tolist()
    if inside and values == _STILL:
        return image[window].copy()
    size = (columns.stop - columns.start, rows.stop - rows.start)
    (a, b, x), (c, d, y) = values
    bend = max(abs(a - 1), abs(b), abs(c), abs(d - 1))
    simple = border in (cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT)
    if bend < _MOST_BEND and simple and image.ndim == 2 and image.flags.c_contiguous:
        out = np.empty((max(size[1], 0), max(size[0], 0)), np.uint8)
        scale = 1 / (a * d - b * c)
        a, b, c, d = scale * d, -scale * b, -scale * c, scale * a
        # From the centres of the window's pixels to those of the image's.
        right, down = columns.start + 0.5 - x, rows.start + 0.5 - y
        x, y = a * right + b * down - 0.5, c * right + d * down - 0.5
        _warp_runs(image, (a, b, x), (c, d, y), border == cv2.BORDER_REPLICATE, out)
        return out
    matrix = pixel_affine(motion)
    matrix[:, 2] -= (columns.start, rows.start)
    return np.asarray(
        cv2.warpAffine(image, matrix, size, flags=cv2.INTER_LINEAR, borderMode=border)
    )


@kernel('u1[:,::1], UniTuple(f8, 3), UniTuple(f8, 3), b1, u1[:,::1]', error_model='numpy')
def _warp_runs(
    image: NDArray[np.uint8],
    across: tuple[float, float, float],
    down: tuple[float, float, float],
    replicate: bool,
    out: NDArray[np.uint8],
) -> None:
    """
    Interpolate an image that is hardly turned or scaled.

    Over a run of pixels the places then lie between the same rows and equally far to the right,
    so that neighbours are read in order and many pixels are done at once.

    :param across: what columns and rows of ``out`` and one make of the column in the image.
    :param down: the same of the row.
    :param replicate: whether the border goes on outside of the image; else it is zero there.
    """
    height, width = image.shape
    a, b, x = np.float32(across[0]), np.float32(across[1]), np.float32(across[2])
    c, d, y = np.float32(down[0]), np.float32(down[1]), np.float32(down[2])
    half = np.float32(0.5)
    for row in range(out.shape[0]):
        from_x, from_y = b * np.float32(row) + x, d * np.float32(row) + y
        start = 0
        while start < out.shape[1]:
            run = _RUN
            while True:
                stop = min(start + run, out.shape[1])
                first, last = np.float32(start), np.float32(stop - 1)
                left, top = int(np.floor(a * first + from_x)), int(np.floor(c * first + from_y))
                end, bottom = int(np.floor(a * last + from_x)), int(np.floor(c * last + from_y))
                straight = end - left == stop - 1 - start and top == bottom
                straight = straight and left >= 0 and end + 1 < width
                straight = straight and (replicate or (top >= 0 and top + 1 < height))
                outside = not replicate and _beyond(left, end, top, bottom, width, height)
                if straight or outside or run == 1:
                    break
                run = run // 4 if run >= 4 else 1
            result = out[row, start:stop]
            if outside:
                result[:] = 0
            elif straight:
                upper = image[min(max(top, 0), height - 1), left : end + 2]
                lower = image[min(max(top + 1, 0), height - 1), left : end + 2]
                for k in range(result.size):
                    col = np.float32(start + k)
                    u = a * col + from_x - np.float32(left + k)
                    v = c * col + from_y - np.float32(top)
                    one, two = np.float32(upper[k]), np.float32(lower[k])
                    one += u * (np.float32(upper[k + 1]) - one)
                    two += u * (np.float32(lower[k + 1]) - two)
                    result[k] = np.uint8(np.int32(one + v * (two - one) + half))
            else:
                at_x, at_y = a * first + from_x, c * first + from_y
                result[0] = _interpolated(image, at_x, at_y, replicate)
            start = stop


@njit(nogil=True, inline='always')
def _beyond(left: int, end: int, top: int, bottom: int, width: int, height: int) -> bool:
    """Return whether all places from one to another are outside of an image."""
    return (
        max(left, end) < -1
        or min(left, end) >= width
        or max(top, bottom) < -1
        or min(top, bottom) >= height
    )


@njit(nogil=True, error_model='numpy')
def _interpolated(
    image: NDArray[np.uint8], x: np.float32, y: np.float32, replicate: bool
) -> np.uint8:
    """Return the value of an image between four pixels, some of which may be outside of it."""
    height, width = image.shape
    left, top = int(np.floor(x)), int(np.floor(y))
    u, v = x - np.float32(left), y - np.float32(top)
    total = np.float32(0)
    for i in range(2):
        for k in range(2):
            row, col = top + i, left + k
            if not replicate and not (0 <= row < height and 0 <= col < width):
                continue
            value = np.float32(image[min(max(row, 0), height - 1), min(max(col, 0), width - 1)])
            share = (v if i else np.float32(1) - v) * (u if k else np.float32(1) - u)
            total += share * value
    return np.uint8(np.int32(total + np.float32(0.5)))
