# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners: how strong they are, and the strongest of an image."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['strength_of', 'strongest']

_QUALITY = 0.01
"""Least strength of a corner, as a share of the strongest."""

_SOBEL = 4 * 3 * 255
"""What a slope of the whole range in all pixels is by Sobel's kernel, with blocks of three."""


def strength_of(gray: NDArray[np.uint8]) -> NDArray[np.float32]:
    """
    Return how strong a corner each pixel is, as ``cv2.cornerMinEigenVal`` does with 3 and 3.

    Several times as fast, since all of it is done row by row.

    :param gray: (h, w) uint8.
    :returns: (h, w) float32, the smaller eigenvalue of the structure tensor.
    """
    out = np.empty(gray.shape, np.float32)
    if out.size:
        _strength(cv2.copyMakeBorder(gray, 1, 1, 1, 1, cv2.BORDER_REFLECT_101), out)
    return out


@njit(nogil=True, fastmath=True, inline='always')
def _products_of_row(
    above: NDArray[np.uint8],
    here: NDArray[np.uint8],
    below: NDArray[np.uint8],
    xx: NDArray[np.float32],
    xy: NDArray[np.float32],
    yy: NDArray[np.float32],
) -> None:
    """Fill in the products of the slopes of a row of pixels, and one mirrored at each end."""
    columns = xx.size - 2
    for col in range(columns):
        a, b, c = np.int32(above[col]), np.int32(above[col + 1]), np.int32(above[col + 2])
        d, e, f = np.int32(below[col]), np.int32(below[col + 1]), np.int32(below[col + 2])
        x = np.float32(c - a + f - d + 2 * (np.int32(here[col + 2]) - np.int32(here[col])))
        y = np.float32(d - a + f - c + 2 * (e - b))
        xx[col + 1], xy[col + 1], yy[col + 1] = x * x, x * y, y * y
    near, far = min(2, columns), max(columns - 1, 1)
    for line in (xx, xy, yy):
        line[0], line[columns + 1] = line[near], line[far]


@kernel('u1[:,::1], f4[:,::1]', fastmath=True, error_model='numpy')
def _strength(padded: NDArray[np.uint8], out: NDArray[np.float32]) -> None:
    """Fill in the strength of the pixels of an image with a mirrored border of one pixel."""
    rows, columns = out.shape
    products = np.empty((3, 3, columns + 2), np.float32)
    total = np.empty((3, columns + 2), np.float32)
    scale = np.float32(1 / _SOBEL**2)
    half = np.float32(0.5)
    for row in range(-1, rows):
        if row + 1 < rows:
            xx, xy, yy = products[(row + 1) % 3]
            _products_of_row(padded[row + 1], padded[row + 2], padded[row + 3], xx, xy, yy)
        if row < 0:
            continue
        # Beyond the border the products are mirrored, too.
        above = products[(row - 1 if row > 0 else min(1, rows - 1)) % 3]
        below = products[(row + 1 if row + 1 < rows else max(rows - 2, 0)) % 3]
        here, line = products[row % 3], out[row]
        for kind in range(3):
            one, two, three = above[kind], here[kind], below[kind]
            for col in range(columns + 2):
                total[kind, col] = one[col] + two[col] + three[col]
        a, b, c = total
        for col in range(columns):
            left = half * (a[col] + a[col + 1] + a[col + 2])
            right = half * (c[col] + c[col + 1] + c[col + 2])
            mixed = b[col] + b[col + 1] + b[col + 2]
            spread = np.sqrt((left - right) * (left - right) + mixed * mixed)
            line[col] = scale * (left + right - spread)


@kernel('f4[:,::1], u1[:,::1], i8, f4[:,::1]')
def _best_of_cells(
    strength: NDArray[np.float32],
    where: NDArray[np.uint8],
    cell: int,
    value: NDArray[np.float32],
) -> None:
    """Find the strongest pixel of each cell among those that are set in ``where``."""
    rows, columns = value.shape
    best = np.empty(cell * columns, np.float32)
    for row in range(rows):
        best[:] = 0
        for inside in range(cell):
            line, use = strength[cell * row + inside], where[cell * row + inside]
            for col in range(best.size):
                here = line[col] if use[col] != 0 else np.float32(0)
                best[col] = max(best[col], here)
        for col in range(columns):
            value[row, col] = best[cell * col : cell * (col + 1)].max()


@kernel('f4[:,::1], u1[:,::1], i8, f4[:,::1], i8[::1], f4[:,::1]')
def _places(
    strength: NDArray[np.float32],
    where: NDArray[np.uint8],
    cell: int,
    value: NDArray[np.float32],
    cells: NDArray[np.intp],
    out: NDArray[np.float32],
) -> None:
    """Fill in where the strongest pixels of some cells are, whose strength is ``value``."""
    columns = value.shape[1]
    for index in range(cells.size):
        row, col = cells[index] // columns, cells[index] % columns
        place = 0
        while True:
            y, x = cell * row + place // cell, cell * col + place % cell
            if strength[y, x] == value[row, col] and where[y, x] != 0:
                break
            place += 1
        out[index, 0], out[index, 1] = x + 0.5, y + 0.5


def strongest(
    strength: NDArray[np.float32],
    where: NDArray[np.uint8],
    cell: int,
    least: float,
    most: int,
) -> NDArray[np.float32]:
    """
    Return the strongest corner of each cell of a grid, strongest first.

    :param strength: (h, w) float32, see :func:`strength_of`.
    :param where: (h, w) uint8, non-zero where corners may lie.
    :param least: strength that a corner must have more than.
    :param most: corners wanted.
    :returns: (n, 2) float32, positions (x, y).
    """
    value = np.empty((strength.shape[0] // cell, strength.shape[1] // cell), np.float32)
    if value.size == 0:
        return np.empty((0, 2), np.float32)
    _best_of_cells(strength, where, cell, value)
    flat = value.ravel()
    cells = np.flatnonzero(flat > max(_QUALITY * float(flat.max()), least))
    cells = cells[np.argsort(-flat[cells], kind='stable')[:most]]
    place = np.empty((len(cells), 2), np.float32)
    _places(strength, where, cell, value, cells, place)
    return place
