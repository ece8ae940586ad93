# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners: where they are, and where they went from one image to the next."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['followed', 'strongest']

_QUALITY = 0.01
"""Least strength of a corner, as a share of the strongest."""

_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 10, 0.02)


def followed(
    last: NDArray[np.uint8],
    now: NDArray[np.uint8],
    points: NDArray[np.float32],
    side: int,
    levels: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """
    Follow points by the pyramidal Lucas-Kanade method.

    :param last, now: (h, w) uint8, two frames.
    :param points: (n, 2) float32, positions (x, y) in the last frame.
    :param side: of the window that is compared, in pixels.
    :param levels: of the pyramid, beside the frames themselves.
    :returns: where those that were found were and are now, (m, 2) float32 each.
    """
    if len(points) == 0:
        return points, points
    # Positions of pixels' centres are whole numbers to OpenCV, half a pixel more to us.
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        last,
        now,
        points[:, None] - 0.5,
        None,
        winSize=(side, side),
        maxLevel=levels,
        criteria=_CRITERIA,
    )
    good = found.ravel() == 1
    return points[good], moved[good, 0] + 0.5


@njit(cache=True, nogil=True)
def _best_of_cells(
    strength: NDArray[np.float32],
    where: NDArray[np.uint8],
    cell: int,
    value: NDArray[np.float32],
    place: NDArray[np.float32],
) -> None:
    """Find the strongest pixel of each cell among those that are set in ``where``."""
    columns = strength.shape[1] // cell
    for index in range(value.size):
        top, left = index // columns * cell, index % columns * cell
        best = np.float32(0)
        for row in range(top, top + cell):
            for col in range(left, left + cell):
                here = strength[row, col]
                if here > best and where[row, col] != 0:
                    best = here
                    place[index, 0] = col + 0.5
                    place[index, 1] = row + 0.5
        value[index] = best


def strongest(
    strength: NDArray[np.float32], where: NDArray[np.uint8], cell: int, least: float
) -> NDArray[np.float32]:
    """
    Return the strongest corner of each cell of a grid, strongest first.

    :param strength: (h, w) float32, the smaller eigenvalue of the structure tensor.
    :param where: (h, w) uint8, non-zero where corners may lie.
    :param least: strength that a corner must have.
    :returns: (n, 2) float32, positions (x, y).
    """
    rows, columns = strength.shape[0] // cell, strength.shape[1] // cell
    value = np.zeros(rows * columns, np.float32)
    place = np.zeros((rows * columns, 2), np.float32)
    if value.size == 0:
        return place
    _best_of_cells(strength, where, cell, value, place)
    order = np.argsort(-value, kind='stable')
    least = max(_QUALITY * value[order[0]], least)
    return place[order[value[order] > least]]
