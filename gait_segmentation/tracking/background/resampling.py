# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Resampling of the remembered background after a motion of the camera.

Cubic, because linear interpolation, frame after frame, would take the contrast out of fine
stripes, which then differ from every new frame.  From frame to frame a camera turns and zooms so
little that over a run of pixels the motion is a shift, for which the weights are the same: so
whole runs are resampled at once, rows first.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel

__all__ = ['resample']

_MOST_OFF = 1 / 64
"""How far the ends of a run may lie off their places, in pixels."""

_LONGEST, _SHORTEST = 64, 4
"""Pixels in a run; where it would be shorter, each pixel is resampled by itself."""

_CHANNELS = 4
_SHARPNESS = -0.75
"""Slope of the cubic kernel at a distance of one pixel, as in OpenCV."""

Weights = tuple[np.float32, np.float32, np.float32, np.float32]
Row = tuple[float, float, float]


def resample(
    sums: NDArray[np.float32],
    motion: NDArray[np.float64],
    factor: float,
    window: Window,
    out: NDArray[np.float32],
) -> None:
    """
    Fill in a window of an image as it looks after a motion of the camera, times a factor.

    What is below zero becomes zero, and what comes from outside of the image is zero.

    :param sums: (h, w, 4) float32.
    :param motion: 2 x 3 transform of positions from the image to the result.
    :param window: rows and columns to fill in.
    :param out: (h, w, 4) float32, the result.
    """
    rows, columns = window
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if min(size) <= 0:
        return
    # In plain numbers, as a 2 x 3 matrix of pixel indices and back again.
    (a, b, x), (c, d, y) = motion.tolist()
    x, y = x + (0.5 * (a + b) - 0.5), y + (0.5 * (c + d) - 0.5)
    x, y = x - columns.start, y - rows.start
    scale = 1 / (a * d - b * c)
    across = (d * scale, -b * scale, (b * y - d * x) * scale)
    down = (-c * scale, a * scale, (c * x - a * y) * scale)
    bend = max(abs(across[0] - 1), abs(down[0]))
    run = _LONGEST if bend * _LONGEST <= 2 * _MOST_OFF else int(2 * _MOST_OFF / bend)
    if run < _SHORTEST:
        matrix = np.array([[a, b, x], [c, d, y]])
        part = np.asarray(cv2.warpAffine(sums, matrix, size, flags=cv2.INTER_CUBIC))
        _scale(part, np.float32(factor))
        out[window] = part
        return
    start = (rows.start, columns.start)
    _resample_runs(_lines(sums), across, down, factor, run, start, size, _lines(out))


def _lines(image: NDArray[np.float32]) -> NDArray[np.float32]:
    return image.reshape(image.shape[0], -1)


@kernel('f4[:,:,::1], f4')
def _scale(sums: NDArray[np.float32], factor: np.float32) -> None:
    """Multiply by a factor what is above zero; the rest becomes zero."""
    for row in range(sums.shape[0]):
        for col in range(sums.shape[1]):
            for channel in range(_CHANNELS):
                value = factor * sums[row, col, channel]
                sums[row, col, channel] = max(value, np.float32(0))


@njit(nogil=True, inline='always')
def _weights(x: np.float32) -> Weights:
    """Return the weights of the four pixels about a place, x after the second."""
    a, one = np.float32(_SHARPNESS), np.float32(1)
    two, three, four, five, eight = (
        np.float32(2),
        np.float32(3),
        np.float32(4),
        np.float32(5),
        np.float32(8),
    )
    before, u = one + x, one - x
    first = ((a * before - five * a) * before + eight * a) * before - four * a
    second = ((a + two) * x - (a + three)) * x * x + one
    third = ((a + two) * u - (a + three)) * u * u + one
    return first, second, third, one - first - second - third


# Places in images are unsigned below: only then is it plain that they do not count from the end,
# and pixels are read many at a time.  Slices would do as well but cost as much as the pixels.


@njit(nogil=True, fastmath=True, inline='always')
def _mix_rows(
    lines: NDArray[np.float32],
    top: int,
    left: int,
    weights: Weights,
    out: NDArray[np.float32],
    size: int,
) -> None:
    """Mix four rows from a place on."""
    a, b, c, d = weights
    first, second = np.uint64(top), np.uint64(top + 1)
    third, fourth = np.uint64(top + 2), np.uint64(top + 3)
    for k in range(size):
        at = np.uint64(left + k)
        one, two = a * lines[first, at], b * lines[second, at]
        out[np.uint64(k)] = one + two + c * lines[third, at] + d * lines[fourth, at]


@njit(nogil=True, fastmath=True, inline='always')
def _mix_pixels(
    line: NDArray[np.float32],
    weights: Weights,
    factor: np.float32,
    out: NDArray[np.float32],
    row: int,
    left: int,
    size: int,
) -> None:
    """Mix four neighbours along a row, and fill in a row of the result from a place on."""
    a, b, c, d = weights
    to = np.uint64(row)
    for k in range(size):
        one, two = a * line[np.uint64(k)], b * line[np.uint64(k + _CHANNELS)]
        three, four = line[np.uint64(k + 2 * _CHANNELS)], line[np.uint64(k + 3 * _CHANNELS)]
        value = factor * (one + two + c * three + d * four)
        out[to, np.uint64(left + k)] = max(value, np.float32(0))


@njit(nogil=True)
def _mix_rows_at_border(
    lines: NDArray[np.float32],
    top: int,
    left: int,
    weights: Weights,
    out: NDArray[np.float32],
) -> None:
    """Do the same where rows or columns are outside of the image: there it is zero."""
    out[:] = np.float32(0)
    columns = lines.shape[1] // _CHANNELS
    for k in range(4):
        row = top + k
        if 0 <= row < lines.shape[0]:
            for place in range(out.size // _CHANNELS):
                col = left + place
                if 0 <= col < columns:
                    for channel in range(_CHANNELS):
                        value = lines[row, _CHANNELS * col + channel]
                        out[_CHANNELS * place + channel] += weights[k] * value


@kernel(
    'f4[:,::1], UniTuple(f8, 3), UniTuple(f8, 3), f8, i8, UniTuple(i8, 2), UniTuple(i8, 2), '
    'f4[:,::1]'
)
def _resample_runs(
    lines: NDArray[np.float32],
    across: Row,
    down: Row,
    share: float,
    run: int,
    start: tuple[int, int],
    size: tuple[int, int],
    out: NDArray[np.float32],
) -> None:
    """
    Fill in a part of an image.

    :param lines: (h, 4 w), the image.
    :param across, down: what columns and rows of the part and one make of the column and the row
        in the image.
    :param start: row and column of the result in which the part begins.
    :param size: its width and height.
    """
    factor = np.float32(share)
    top, left = start
    width, height = size
    rows, columns = lines.shape[0], lines.shape[1] // _CHANNELS
    mixed = np.empty(_CHANNELS * (_LONGEST + 3), np.float32)
    for row in range(height):
        for col in range(0, width, run):
            count = min(run, width - col)
            half = (count - 1) / 2
            x = across[0] * (col + half) + across[1] * row + across[2] - half
            y = down[0] * (col + half) + down[1] * row + down[2]
            from_x, from_y = int(np.floor(x)), int(np.floor(y))
            by_column = _weights(np.float32(x - from_x))
            by_row = _weights(np.float32(y - from_y))
            from_x, from_y = from_x - 1, from_y - 1
            wide = _CHANNELS * (count + 3)
            if 0 <= from_x <= columns - count - 3 and 0 <= from_y <= rows - 4:
                _mix_rows(lines, from_y, _CHANNELS * from_x, by_row, mixed, wide)
            else:
                _mix_rows_at_border(lines, from_y, from_x, by_row, mixed[:wide])
            first = _CHANNELS * (left + col)
            _mix_pixels(mixed, by_column, factor, out, top + row, first, _CHANNELS * count)
