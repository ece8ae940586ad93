# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Shape-texture: the orientation of the brightness gradients about a pixel.

Gradients g of a small neighbourhood vote with their squared length for twice their angle, so that
both flanks of a stripe vote alike (the structure tensor's main direction); pixels with weak
gradients say nothing.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.features.base import NEUTRAL, ChannelFeature, View

__all__ = ['FEATURE']

_SIDE = 5
"""Side of the neighbourhood in pixels."""

_REACH = _SIDE // 2

_LEAST = 150.0
"""Mean squared gradient, per pixel of distance, below which nothing is said (12 grey levels)."""


def _channel(view: View) -> NDArray[np.uint8]:
    """Return 8..255 for angles of 0..pi, NEUTRAL without gradients."""
    shape = tuple(-(-size // view.step) for size in view.gray.shape)
    real, imaginary = np.empty(shape, np.float32), np.empty(shape, np.float32)
    _tensor(np.ascontiguousarray(view.gray), view.step, real, imaginary)
    length, angle = cv2.cartToPolar(real, imaginary)
    out = np.empty(shape, np.uint8)
    _values(length, angle, out)
    return out


@njit(nogil=True)
def _mirrored(place: int, size: int) -> int:
    """Return where a place outside of a line lies mirrored at the line's last pixels."""
    if size == 1:
        return 0
    turn = 2 * (size - 1)
    place = abs(place) % turn
    return place if place < size else turn - place


@njit(nogil=True)
def _products(
    gray: NDArray[np.uint8], row: int, real: NDArray[np.int32], imaginary: NDArray[np.int32]
) -> None:
    """Fill in the squared gradient, as a complex number, of a row and what is mirrored of it."""
    height, width = gray.shape
    above, here, below = (
        gray[_mirrored(row - 1, height)],
        gray[row],
        gray[_mirrored(row + 1, height)],
    )
    # How much a column changes from above to below, and its weighted sum.
    change, total = np.empty(width + 2, np.int32), np.empty(width + 2, np.int32)
    for col in range(width):
        a, b, c = np.int32(above[col]), np.int32(here[col]), np.int32(below[col])
        change[col + 1] = c - a
        total[col + 1] = a + b + b + c
    for place, inner in ((0, _mirrored(-1, width)), (width + 1, _mirrored(width, width))):
        change[place], total[place] = change[inner + 1], total[inner + 1]
    for col in range(width):
        dx = total[col + 2] - total[col]
        dy = change[col] + np.int32(2) * change[col + 1] + change[col + 2]
        real[col + _REACH] = dx * dx - dy * dy
        imaginary[col + _REACH] = np.int32(2) * dx * dy
    for out in range(-_REACH, 0):
        for place in (out, width - 1 - out):
            inner = _mirrored(place, width) + _REACH
            real[place + _REACH] = real[inner]
            imaginary[place + _REACH] = imaginary[inner]


@kernel('u1[:,::1], i8, f4[:,::1], f4[:,::1]')
def _tensor(
    gray: NDArray[np.uint8],
    step: int,
    real: NDArray[np.float32],
    imaginary: NDArray[np.float32],
) -> None:
    """Fill in the mean squared gradient about every ``step``-th pixel, in grey levels a pixel."""
    height, width = gray.shape
    # An eighth of what is summed up is the gradient.
    share = 1 / (64 * _SIDE * _SIDE)
    # Of the last rows, the sums of their columns, and of as many of these.
    kept = np.empty((2, _SIDE, width + 2 * _REACH), np.int32)
    sums = np.empty(width + 2 * _REACH, np.int32)
    wide = np.empty(width, np.int32)
    known = 0
    for line in range(real.shape[0]):
        row = line * step
        while known < min(row + _REACH + 1, height):
            place = known % _SIDE
            _products(gray, known, kept[0, place], kept[1, place])
            known += 1
        for part in range(2):
            rows = kept[part]
            a = rows[_mirrored(row - 2, height) % _SIDE]
            b = rows[_mirrored(row - 1, height) % _SIDE]
            c = rows[row % _SIDE]
            d = rows[_mirrored(row + 1, height) % _SIDE]
            e = rows[_mirrored(row + 2, height) % _SIDE]
            for col in range(sums.size):
                sums[col] = a[col] + b[col] + c[col] + d[col] + e[col]
            for col in range(width):
                wide[col] = (
                    sums[col] + sums[col + 1] + sums[col + 2] + sums[col + 3] + sums[col + 4]
                )
            out = imaginary[line] if part else real[line]
            for k in range(out.size):
                out[k] = np.float32(np.float64(wide[k * step]) * share)


@kernel('f4[:,::1], f4[:,::1], u1[:,::1]')
def _values(
    length: NDArray[np.float32], angle: NDArray[np.float32], out: NDArray[np.uint8]
) -> None:
    scale, first, last = np.float32(247 / (2 * np.pi)), np.float32(8), np.float32(255)
    least = np.float32(_LEAST)
    for row in range(out.shape[0]):
        for col in range(out.shape[1]):
            value = np.int32(min(first + angle[row, col] * scale, last))
            out[row, col] = NEUTRAL if length[row, col] < least else value


FEATURE = ChannelFeature('orientation', _channel, has_neutral=True)
