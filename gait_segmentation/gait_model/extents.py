# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far silhouettes reach on their grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['extents']


@kernel('u1[:,:,::1], u1[:,::1], u1[:,::1]')
def _project(
    images: NDArray[np.uint8], by_row: NDArray[np.uint8], by_column: NDArray[np.uint8]
) -> None:
    """Put the brightest of each row and column into zeros."""
    for k in range(images.shape[0]):
        columns = by_column[k]
        for row in range(images.shape[1]):
            line = images[k, row]
            brightest = np.uint8(0)
            for col in range(len(line)):
                brightest = max(brightest, line[col])
                columns[col] = max(columns[col], line[col])
            by_row[k, row] = brightest


def extents(
    images: NDArray[np.uint8], thresholds: tuple[int, ...]
) -> tuple[NDArray[np.int32], ...]:
    """
    Return the tight boxes of what is brighter than each threshold.

    :param images: (..., h, w) uint8.
    :returns: (..., 4) int32 for each: left, top, width and height, all 0 where nothing is.
    """
    height, width = images.shape[-2:]
    laid = np.ascontiguousarray(images).reshape(-1, height, width)
    by_row = np.zeros((len(laid), height), np.uint8)
    by_column = np.zeros((len(laid), width), np.uint8)
    _project(laid, by_row, by_column)
    found = []
    for threshold in thresholds:
        box = np.zeros((len(laid), 4), np.int32)
        for axis, lines in enumerate((by_column > threshold, by_row > threshold)):
            first = lines.argmax(axis=1)
            last = lines.shape[1] - lines[:, ::-1].argmax(axis=1)
            box[:, axis] = first
            box[:, axis + 2] = np.where(lines.any(axis=1), last - first, 0)
        found.append(box.reshape(*images.shape[:-2], 4))
    return tuple(found)
