# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small image operations more than one stage needs."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import pixel_affine
from gait_segmentation.sizes import same_proportions, shrink

__all__ = [
    'Bounds',
    'Window',
    'bounding_box',
    'check_image',
    'check_map',
    'check_stamp',
    'count_likely',
    'same_proportions',
    'shift_whole',
    'shrink',
    'signed_distance',
    'warp_window',
]

Window = tuple[slice, slice]
"""Rows and columns of a part of an image."""

Bounds = tuple[int, int, int, int]
"""Left, top, width and height of a part of an image."""


_WORD = 8
"""Pixels of one byte that are looked at together."""

_STILL = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]

_RUN, _MOST_BEND = 64, 1 / 128
"""Pixels warped at once, and the largest turn or change of scale for which that pays."""


def signed_distance(inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return the distance to the edge of a region in pixels, positive inside, (h, w) float32.

    By the chamfer metric of 3 x 3 pixels, true to about 5 %, which saturating terms do not feel.
    Without an edge in the image it is the image's diagonal.
    """
    region = inside.astype(np.uint8)
    within = cv2.distanceTransform(region, cv2.DIST_L2, 3)
    without = cv2.distanceTransform(1 - region, cv2.DIST_L2, 3)
    diagonal = np.float32(np.hypot(*inside.shape))
    return np.clip(within - without, -diagonal, diagonal)


def bounding_box(mask: NDArray[np.uint8]) -> Bounds:
    """
    Return left, top, width and height of what is not zero, as ``cv2.boundingRect`` does.

    Several times as fast, since whole rows are looked at at once.

    :param mask: (h, w) uint8, rows contiguous.
    """
    whole = mask.flags.c_contiguous and mask.size > 0 and mask.shape[1] % _WORD == 0
    # Eight pixels at once, if there are as many in a row.
    left, top, right, bottom = _bounds(mask.view(np.uint64) if whole else mask)
    return left, top, right - left, bottom - top


@njit(cache=True, nogil=True)
def _bounds(lines: NDArray[np.uint8] | NDArray[np.uint64]) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom in bytes and rows; all zero if there is nothing."""
    height, width = lines.shape
    columns = np.zeros(width, lines.dtype)
    top, bottom = height, 0
    for row in range(height):
        line = lines[row]
        some = lines[0, 0] ^ lines[0, 0]
        for col in range(width):
            some |= line[col]
        if some != 0:
            top, bottom = min(top, row), row + 1
            for col in range(width):
                columns[col] |= line[col]
    if bottom == 0:
        return 0, 0, 0, 0
    flat = columns.view(np.uint8)
    left, right = 0, flat.size
    while flat[left] == 0:
        left += 1
    while flat[right - 1] == 0:
        right -= 1
    return left, top, right, bottom


@njit(cache=True, nogil=True)
def count_likely(image: NDArray[np.uint8]) -> int:
    """Return how many pixels of a (h, w) uint8 likelihood, mask or template are above 127."""
    total = 0
    for row in range(image.shape[0]):
        line, count = image[row], np.int32(0)
        for col in range(line.size):
            count += np.int32(line[col] >> 7)
        total += count
    return total


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


@njit(cache=True, nogil=True, error_model='numpy')
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


def check_image(image: NDArray[np.uint8]) -> None:
    """
    Refuse what is no BGR image.

    :raises InputError: if the array is not (height, width, 3) uint8 with at least one pixel.
    """
    if not isinstance(image, np.ndarray) or image.ndim != 3 or image.shape[2] != 3:
        raise InputError(f'image must be a (height, width, 3) array, got shape {np.shape(image)}')
    if image.dtype != np.uint8:
        raise InputError(f'image must be uint8, got {image.dtype}')
    if image.size == 0:
        raise InputError(f'image must have at least one pixel, got {image.shape}')


def check_map(array: NDArray[np.uint8], name: str) -> None:
    """
    Refuse what is no image of one value a pixel.

    :param array: (h, w) uint8.
    :param name: what the message calls it.
    :raises InputError: if it has another shape or type.
    """
    if array.ndim != 2 or array.dtype != np.uint8:
        raise InputError(f'{name} must be (height, width) uint8, got {array.shape} {array.dtype}')


def check_stamp(stamp_ns: int) -> None:
    """
    Refuse the stamp zero, which would make all frames the same.

    :raises InputError: if the stamp is not positive.
    """
    if stamp_ns <= 0:
        raise InputError(f'stamp must be positive nanoseconds, got {stamp_ns}')


def shift_whole(image: NDArray[np.uint8], dx: int, dy: int) -> NDArray[np.uint8]:
    """
    Shift an image by whole pixels, zero where nothing is known.

    :param image: (H, W) or (H, W, C) uint8.
    :returns: an image of the same shape; ``image`` itself if nothing moves.
    """
    if dx == 0 and dy == 0:
        return image
    moved = np.zeros_like(image)
    to_rows, from_rows = _overlap(dy, image.shape[0])
    to_columns, from_columns = _overlap(dx, image.shape[1])
    moved[to_rows, to_columns] = image[from_rows, from_columns]
    return moved


def _overlap(step: int, size: int) -> tuple[slice, slice]:
    """Return where a shifted range of a size lies in the unshifted one, and which part of it."""
    low, high = min(max(step, 0), size), min(max(size + step, 0), size)
    return slice(low, high), slice(low - step, high - step)
