# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Points followed from one frame to the next by the pyramidal method of Lucas and Kanade.

As in OpenCV, but slopes are taken only about the points, which are few, and not of whole images,
and the smaller images are those that others have made.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.ego_motion.pyramid import BORDER, Pyramid
from gait_segmentation.kernels import kernel

__all__ = ['followed']

_SIDE = 11
"""Side of the window about a point that is compared, in pixels."""

_LANES = 16
"""Pixels of a row that are done at once; those beyond the window do not count."""

_STEPS = 10
_ARRIVED, _SWAYING = 0.02, 0.01
"""A step as short as the one, or as near to the one back as the other, is the last (pixels)."""

_LEAST_STRENGTH = 0.1
"""Least mean squared slope, in the direction where it is smallest, of what can be followed."""

Weights = tuple[np.float32, np.float32, np.float32, np.float32]


def followed(
    last: Pyramid,
    now: Pyramid,
    points: NDArray[np.float32],
    levels: range,
    expected: tuple[float, float] = (0.0, 0.0),
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """
    Follow points.

    :param last, now: two frames.
    :param points: (n, 2) float32, positions (x, y) in the last frame.
    :param levels: of the pyramids to use, the largest image first.
    :param expected: shift (x, y) in pixels about which they are sought.
    :returns: where those that were found were and are now, (m, 2) float32 each.
    """
    if len(points) == 0:
        return points, points
    moved = points + np.array(expected, np.float32)
    found = np.ones(len(points), np.bool_)
    for level in reversed(levels):
        # Small images need not be as exact.
        arrived = _ARRIVED * 2.0 ** (level - levels.start)
        before, after = last.padded(level), now.padded(level)
        _follow(before, after, BORDER, points, moved, 0.5**level, arrived, found)
    return points[found], moved[found]


@njit(nogil=True, fastmath=True, inline='always')
def _weights(x: float, y: float) -> Weights:
    """Return the weights of four pixels, the first of which is that far up and to the left."""
    one, u, v = np.float32(1), np.float32(x), np.float32(y)
    return (one - u) * (one - v), u * (one - v), (one - u) * v, u * v


@njit(nogil=True, fastmath=True, inline='always')
def _interpolate(
    image: NDArray[np.uint8],
    top: int,
    left: int,
    weights: Weights,
    out: NDArray[np.float32],
) -> None:
    """Fill in what lies between pixels of an image."""
    a, b, c, d = weights
    for row in range(out.shape[0]):
        # Places that cannot be negative are not looked at for being so, and read many at once.
        i, j = np.uint64(top + row), np.uint64(top + row + 1)
        for k in range(_LANES):
            x, y = np.uint64(left + k), np.uint64(left + k + 1)
            upper = a * np.float32(image[i, x]) + b * np.float32(image[i, y])
            lower = c * np.float32(image[j, x]) + d * np.float32(image[j, y])
            out[row, k] = upper + lower


@njit(nogil=True, fastmath=True, inline='always')
def _slopes(
    values: NDArray[np.float32], counts: NDArray[np.float32], out: NDArray[np.float32]
) -> tuple[np.float32, np.float32, np.float32]:
    """Fill in the slopes across and down; return the sums of their products."""
    near, far = np.float32(3), np.float32(10)
    xx = xy = yy = np.float32(0)
    for row in range(_SIDE):
        for k in range(_LANES):
            a = values[row, k + 2] - values[row, k]
            b = values[row + 1, k + 2] - values[row + 1, k]
            c = values[row + 2, k + 2] - values[row + 2, k]
            gx = counts[k] * (near * (a + c) + far * b)
            a = values[row + 2, k] - values[row, k]
            b = values[row + 2, k + 1] - values[row, k + 1]
            c = values[row + 2, k + 2] - values[row, k + 2]
            gy = counts[k] * (near * (a + c) + far * b)
            out[row, k], out[row, _LANES + k] = gx, gy
            xx += gx * gx
            xy += gx * gy
            yy += gy * gy
    return xx, xy, yy


@njit(nogil=True, fastmath=True, inline='always')
def _differences(
    image: NDArray[np.uint8],
    top: int,
    left: int,
    weights: Weights,
    values: NDArray[np.float32],
    slopes: NDArray[np.float32],
) -> tuple[np.float32, np.float32]:
    """Return the sums of the differences from an image times the slopes across and down."""
    a, b, c, d = weights
    x = y = np.float32(0)
    for row in range(0, _SIDE + 1, 2):
        first = image[top + row, left : left + _LANES + 1]
        second = image[top + row + 1, left : left + _LANES + 1]
        third = image[top + row + 2, left : left + _LANES + 1]
        upper, lower = values[row + 1], values[row + 2]
        above, below = slopes[row], slopes[row + 1]
        for k in range(_LANES):
            one, two = np.float32(second[k]), np.float32(second[k + 1])
            up = a * np.float32(first[k]) + b * np.float32(first[k + 1]) + c * one + d * two
            down = a * one + b * two + c * np.float32(third[k]) + d * np.float32(third[k + 1])
            up, down = up - upper[k + 1], down - lower[k + 1]
            x += up * above[k] + down * below[k]
            y += up * above[_LANES + k] + down * below[_LANES + k]
    return x, y


@kernel(
    'u1[:,::1], u1[:,::1], i8, f4[:,::1], f4[:,::1], f8, f8, b1[::1]',
    fastmath=True,
    error_model='numpy',
)
def _follow(
    last: NDArray[np.uint8],
    now: NDArray[np.uint8],
    border: int,
    points: NDArray[np.float32],
    moved: NDArray[np.float32],
    scale: float,
    arrived: float,
    found: NDArray[np.bool_],
) -> None:
    """
    Improve where points are now in the images of one level.

    :param last, now: both with a border of that many pixels.
    :param points: (n, 2) float32, positions at full size.
    :param moved: where they are thought to be now, likewise; changed.
    :param scale: size of the level over full size.
    :param arrived: step in pixels that is the last.
    :param found: of the points; changed to False for those that this level has lost, and to True
        for the others.
    """
    # Rows are taken in pairs; one beyond the window is the second of the last pair.
    values = np.zeros((_SIDE + 3, _LANES + 2), np.float32)
    slopes = np.zeros((_SIDE + 1, 2 * _LANES), np.float32)
    counts = np.zeros(_LANES, np.float32)
    counts[:_SIDE] = np.float32(1 / 32)
    half = _SIDE / 2
    height, width = now.shape[0] - 2 * border, now.shape[1] - 2 * border
    for index in range(points.shape[0]):
        found[index] = False
        x, y = scale * points[index, 0] - half, scale * points[index, 1] - half
        left, top = int(np.floor(x)), int(np.floor(y))
        if not (-_SIDE <= left < width and -_SIDE <= top < height):
            continue
        # One more pixel all about the window is needed for the slopes.
        weights = _weights(x - left, y - top)
        _interpolate(last, top + border - 1, left + border - 1, weights, values)
        xx, xy, yy = _slopes(values, counts, slopes)
        spread = np.sqrt((xx - yy) * (xx - yy) + 4 * xy * xy)
        determinant = xx * yy - xy * xy
        if xx + yy - spread < 2 * _LEAST_STRENGTH * _SIDE * _SIDE or determinant <= 0:
            continue
        xx, xy, yy = xx / determinant, xy / determinant, yy / determinant
        x, y = scale * moved[index, 0] - half, scale * moved[index, 1] - half
        before_x = before_y = 0.0
        for step in range(_STEPS):
            left, top = int(np.floor(x)), int(np.floor(y))
            found[index] = -_SIDE <= left < width and -_SIDE <= top < height
            if not found[index]:
                break
            weights = _weights(x - left, y - top)
            off_x, off_y = _differences(now, top + border, left + border, weights, values, slopes)
            step_x, step_y = xy * off_y - yy * off_x, xy * off_x - xx * off_y
            x, y = x + step_x, y + step_y
            if step_x * step_x + step_y * step_y <= arrived * arrived:
                break
            swaying = abs(step_x + before_x) < _SWAYING and abs(step_y + before_y) < _SWAYING
            if step > 0 and swaying:
                x, y = x - step_x / 2, y - step_y / 2
                break
            before_x, before_y = step_x, step_y
        moved[index, 0], moved[index, 1] = (x + half) / scale, (y + half) / scale
