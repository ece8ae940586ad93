# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small operations on images and their values that more than one stage needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.kernels import kernel

Window = tuple[slice, slice]
"""Rows and columns of a part of an image."""

Bounds = tuple[int, int, int, int]
"""Left, top, width and height of a part of an image."""


def distance_from(inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return distances from a region as :func:`signed_distance`, (h, w) float32; far if none."""
    return np.asarray(cv2.distanceTransform((~inside).view(np.uint8), cv2.DIST_L2, 3))


def signed_distance(inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return the distance to the edge of a region in pixels, positive inside, (h, w) float32.

    By the chamfer metric of 3 x 3 pixels, true to about 5 %, which saturating terms do not feel.
    Without an edge in the image it is the image's diagonal.
    """
    distance = distance_from(~inside)
    distance -= distance_from(inside)
    diagonal = np.float32(np.hypot(*inside.shape))
    return np.clip(distance, -diagonal, diagonal, out=distance)


def bounding_box(mask: NDArray[np.uint8]) -> Bounds:
    """Return left, top, width and height of what is not zero of a (h, w) uint8 mask."""
    left, top, width, height = cv2.boundingRect(mask) if mask.size else (0, 0, 0, 0)
    return left, top, width, height


def count_likely(image: NDArray[np.uint8]) -> int:
    """Return how many pixels of a (h, w) uint8 likelihood, mask or template are above 127."""
    if image.size == 0:
        return 0
    return cv2.countNonZero(cv2.threshold(image, 127, 1, cv2.THRESH_BINARY)[1])


def axis_tilt(mask: NDArray[np.uint8]) -> float:
    """Return by how much the main axis of a mask leans to the right, in radians."""
    moments = cv2.moments(mask, binaryImage=True)
    return 0.5 * math.atan2(-2 * moments['mu11'], moments['mu02'] - moments['mu20'])


def check_image(image: NDArray[np.uint8]) -> None:
    """Raise InputError for all but (height, width, 3) uint8 with at least one pixel."""
    known = isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.size > 0
    if not (known and image.ndim == 3 and image.shape[2] == 3):
        raise InputError(
            'image must be a (height, width, 3) uint8 array with at least one pixel, got '
            f'{_kind(image)}'
        )


def _kind(array: Any) -> str:
    if array is None:
        return 'None, as of a frame that cannot be read'
    if isinstance(array, np.ndarray):
        return f'{array.shape} {array.dtype}'
    return type(array).__name__


def check_map(array: NDArray[np.uint8], name: str) -> None:
    """
    Refuse what is no image of one value a pixel.

    :param array: (h, w) uint8.
    :param name: what the message calls it.
    :raises InputError: if it has another shape or type.
    """
    if not (isinstance(array, np.ndarray) and array.ndim == 2 and array.dtype == np.uint8):
        raise InputError(f'{name} must be (height, width) uint8, got {_kind(array)}')


def size_of(window: Window) -> tuple[int, int]:
    """Return the number of rows and of columns of a window."""
    rows, columns = window
    return rows.stop - rows.start, columns.stop - columns.start


def overlap(one: Window, two: Window) -> Window | None:
    """Return the rows and columns two windows share, None if there are none."""
    rows, columns = (
        slice(max(a.start, b.start), min(a.stop, b.stop)) for a, b in zip(one, two, strict=True)
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None
    return rows, columns


def within(part: Window, window: Window) -> Window:
    """Return the rows and columns of a part of the image in a window of it."""
    rows, columns = (
        slice(side.start - whole.start, side.stop - whole.start)
        for side, whole in zip(part, window, strict=True)
    )
    return rows, columns


def shifted_part(image: NDArray[np.uint8], dx: int, dy: int, window: Window) -> NDArray[np.uint8]:
    """
    Return a window of an image shifted by whole pixels, zero where nothing is known.

    :param image: (H, W) or (H, W, C) uint8.
    :param window: rows and columns of the result, inside of the image.
    :returns: (h, w) or (h, w, C) uint8, a part of ``image`` itself if nothing moves.
    """
    if dx == 0 and dy == 0:
        return image[window]
    (top, bottom), (left, right) = ((side.start, side.stop) for side in window)
    part = np.zeros((bottom - top, right - left, *image.shape[2:]), image.dtype)
    # What is known: rows from `up` to `down`, columns from `near` to `far`.
    up, near = max(top, dy), max(left, dx)
    down, far = (
        max(up, min(bottom, image.shape[0] + dy)),
        max(near, min(right, image.shape[1] + dx)),
    )
    known = image[up - dy : down - dy, near - dx : far - dx]
    part[up - top : down - top, near - left : far - left] = known
    return part


def placed(part: NDArray[np.uint8], window: Window, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return (H, W) uint8 that is zero but for (h, w) uint8 in a window."""
    image = np.zeros(shape, np.uint8)
    image[window] = part
    return image


def same_proportions(shape: tuple[int, ...], source: tuple[int, ...]) -> bool:
    """Tell whether (h, w) can be (H, W) scaled, to a pixel."""
    lowest = max((size - 1) / whole for size, whole in zip(shape, source, strict=True))
    highest = min((size + 1) / whole for size, whole in zip(shape, source, strict=True))
    return lowest <= highest


def shrink(
    image: NDArray[np.uint8], shape: tuple[int, int], rest: int = cv2.INTER_LINEAR
) -> NDArray[np.uint8]:
    """
    Return an image at a smaller size, without aliasing.

    It is halved by averaging 2 x 2 pixels, which OpenCV does far faster than any other area, as
    often as that leaves it large enough, and interpolated for the rest.

    :param image: (H, W) or (H, W, 3) uint8.
    :param shape: (h, w) of the result.
    :param rest: how OpenCV interpolates for the rest.
    """
    while image.shape[0] >= 2 * shape[0] and image.shape[1] >= 2 * shape[1]:
        half = (image.shape[1] // 2, image.shape[0] // 2)
        whole = image[: 2 * half[1], : 2 * half[0]]
        image = np.asarray(cv2.resize(whole, half, interpolation=cv2.INTER_AREA))
    if image.shape[:2] != shape:
        image = np.asarray(cv2.resize(image, shape[::-1], interpolation=rest))
    return image


def median(values: NDArray[np.floating]) -> Any:
    """Return the median along the first axis, without NaN, not empty; sooner than NumPy's."""
    middle = len(values) // 2
    # Of one place only, for which NumPy has a way that is much faster than that for two.
    ordered = np.partition(values, middle, axis=0)
    if len(values) % 2:
        return ordered[middle]
    return (ordered[:middle].max(axis=0) + ordered[middle]) / 2


def quantiles(values: NDArray[np.floating], shares: Sequence[float]) -> list[float]:
    """Return quantiles of (n,) values, not empty, by shares (0..1) that are smaller."""
    places = (len(values) - 1) * np.array(shares)
    low, high = np.floor(places).astype(int), np.ceil(places).astype(int)
    ordered = np.partition(values, np.concatenate([low, high]))
    return (ordered[low] + (places - low) * (ordered[high] - ordered[low])).tolist()


def inner_range(counts: NDArray[np.integer], share: float) -> tuple[int, int]:
    """
    Return where counts begin and end, without a share of their sum at either end.

    :param counts: (n,), such as the pixels of each row of a mask; not all zero.
    :returns: index of the first and the one after the last.
    """
    total = np.cumsum(counts)
    first, last = np.searchsorted(total, (share * total[-1], (1 - share) * total[-1]))
    return int(first), int(last) + 1


def tanimoto(
    shapes: NDArray[np.uint8], shape: NDArray[np.uint8], beyond: int = 0
) -> NDArray[np.float64]:
    """
    Return the Tanimoto similarity of shapes with one (paper, Eq. 1), 0 to 1.

    :param shapes: (..., h, w) uint8.
    :param shape: (h, w) uint8.
    :param beyond: sum of what of the one lies beyond these pixels, where the others are zero.
    """
    flat = np.ascontiguousarray(shapes).reshape(-1, shape.size)
    common, either = np.zeros((2, len(flat)), np.int64)
    _overlaps(flat, shape.ravel(), common, either)
    return (common / np.maximum(either + beyond, 1)).reshape(shapes.shape[:-2])


@kernel('u1[:,::1], u1[::1], i8[::1], i8[::1]')
def _overlaps(
    shapes: NDArray[np.uint8],
    shape: NDArray[np.uint8],
    common: NDArray[np.int64],
    either: NDArray[np.int64],
) -> None:
    for k in range(shapes.shape[0]):
        least, most = 0, 0
        for x in range(shape.size):
            least += min(shapes[k, x], shape[x])
            most += max(shapes[k, x], shape[x])
        common[k], either[k] = least, most
