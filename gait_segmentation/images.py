# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small image operations more than one stage needs."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import pixel_affine

__all__ = [
    'Window',
    'check_image',
    'check_map',
    'check_stamp',
    'same_proportions',
    'shift_whole',
    'shrink',
    'signed_distance',
    'warp_window',
]

Window = tuple[slice, slice]
"""Rows and columns of a part of an image."""


_STILL = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


def same_proportions(shape: tuple[int, ...], source: tuple[int, ...]) -> bool:
    """
    Tell whether one size can be another one scaled, to a pixel.

    :param shape: (h, w).
    :param source: (H, W).
    """
    lowest = max((size - 1) / whole for size, whole in zip(shape, source, strict=True))
    highest = min((size + 1) / whole for size, whole in zip(shape, source, strict=True))
    return lowest <= highest


def shrink(image: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Return an image at a smaller size, without aliasing.

    It is halved by averaging 2 x 2 pixels, which OpenCV does far faster than any other area, as
    often as that leaves it large enough, and interpolated for the rest.

    :param image: (H, W) or (H, W, 3) uint8.
    :param shape: (h, w) of the result.
    """
    while image.shape[0] >= 2 * shape[0] and image.shape[1] >= 2 * shape[1]:
        half = (image.shape[1] // 2, image.shape[0] // 2)
        whole = image[: 2 * half[1], : 2 * half[0]]
        image = np.asarray(cv2.resize(whole, half, interpolation=cv2.INTER_AREA))
    if image.shape[:2] != shape:
        image = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_LINEAR)
    return image


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
    if inside and motion.tolist() == _STILL:
        return image[window].copy()
    matrix = pixel_affine(motion)
    matrix[:, 2] -= (columns.start, rows.start)
    size = (columns.stop - columns.start, rows.stop - rows.start)
    return np.asarray(
        cv2.warpAffine(image, matrix, size, flags=cv2.INTER_LINEAR, borderMode=border)
    )


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
