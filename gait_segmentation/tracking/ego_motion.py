# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Motion of the camera and of the body between two frames, from sparse optical flow.

Corners are followed by the pyramidal Lucas-Kanade method; those away from people give the
camera's motion as a robust similarity, those on the person the body's shift.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['Motion', 'MotionEstimator']

_CORNERS_AROUND = 100
_CORNERS_ON_BODY = 50
_LEAST_AROUND = 8
_LEAST_ON_BODY = 6
_STILL_PX = 0.2
_RANSAC_PX = 1.5
_WINDOW, _LEVELS = (15, 15), 3
_CELL_AROUND, _CELL_ON_BODY = 8, 3
"""Sides of the cells with one corner each, in pixels of half the size."""

_QUALITY = 0.01
"""Least strength of a corner, as a share of the strongest."""


@dataclass(frozen=True)
class Motion:
    """
    What moved from the last frame to this one, in working pixels.

    ``camera`` is the 2 x 3 transform of positions of the still world, None when it did not move.
    ``body`` is the shift (dx, dy) of the person's body in the image, None if it could not be
    measured.
    """

    camera: NDArray[np.float64] | None
    body: tuple[float, float] | None

    def carry(self, x: float, y: float) -> tuple[float, float]:
        """Return where the camera's motion moves a position of the still world."""
        if self.camera is None:
            return x, y
        moved = self.camera[:, :2] @ np.array([x, y]) + self.camera[:, 2]
        return float(moved[0]), float(moved[1])


class MotionEstimator:
    """Follows corners from one frame to the next."""

    def __init__(self) -> None:
        """Start without a last frame."""
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: NDArray[np.uint8] | None = None

    def update(
        self,
        gray: NDArray[np.uint8],
        people: NDArray[np.uint8] | None,
        body: NDArray[np.uint8] | None,
        *,
        camera: bool = True,
    ) -> Motion:
        """
        Measure the motion since the last frame.

        :param gray: (h, w) uint8, this frame.
        :param people: (h, w) uint8 of the last frame, non-zero where people may be; corners of
            the still world are taken elsewhere.
        :param body: (h, w) uint8 of the last frame, non-zero on the tracked person.
        :param camera: whether to estimate the motion of the camera.
        """
        last, self._last = self._last, gray
        if last is None or last.shape != gray.shape:
            return Motion(None, None)
        around, on_body = _corners(last, people, body)
        if not camera:
            around = around[:0]
        points = np.concatenate([around, on_body])
        if len(points) == 0:
            return Motion(None, None)
        moved, found, _ = cv2.calcOpticalFlowPyrLK(
            last, gray, points, None, winSize=_WINDOW, maxLevel=_LEVELS
        )
        good = found.ravel() == 1
        split = len(around)
        transform = _camera_motion(points[:split][good[:split]], moved[:split][good[:split]])
        shift = (moved - points)[split:][good[split:]].reshape(-1, 2)
        return Motion(transform, _median_shift(shift))


def _corners(
    gray: NDArray[np.uint8], people: NDArray[np.uint8] | None, body: NDArray[np.uint8] | None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Find corners of the world and on the body, at half size, where the search is cheap."""
    half = cv2.resize(gray, (gray.shape[1] // 2, gray.shape[0] // 2), interpolation=cv2.INTER_AREA)
    strength = cv2.cornerMinEigenVal(half, 3)
    size = half.shape[::-1]
    near = None if people is None else cv2.resize(people, size, interpolation=cv2.INTER_NEAREST)
    around = _strongest(strength, None if near is None else near == 0, _CELL_AROUND)
    if body is None:
        return around[:_CORNERS_AROUND], around[:0]
    on_body = cv2.resize(body, size, interpolation=cv2.INTER_NEAREST) != 0
    return around[:_CORNERS_AROUND], _strongest(strength, on_body, _CELL_ON_BODY)[
        :_CORNERS_ON_BODY
    ]


def _strongest(
    strength: NDArray[np.float32], where: NDArray[np.bool_] | None, cell: int
) -> NDArray[np.float32]:
    """
    Return the strongest corner of each cell of a grid, strongest first.

    :param strength: (h, w) float32, the smaller eigenvalue of the structure tensor.
    :param where: (h, w) bool, where corners may lie.
    :returns: (n, 1, 2) float32, (x, y) in the image of twice the size.
    """
    if where is not None:
        strength = np.where(where, strength, np.float32(0))
    rows, columns = strength.shape[0] // cell, strength.shape[1] // cell
    if rows == 0 or columns == 0 or strength.max() <= 0:
        return np.empty((0, 1, 2), np.float32)
    cells = (
        strength[: rows * cell, : columns * cell]
        .reshape(rows, cell, columns, cell)
        .transpose(0, 2, 1, 3)
        .reshape(rows * columns, cell * cell)
    )
    best = cells.argmax(axis=1)
    value = cells[np.arange(len(cells)), best]
    order = np.argsort(-value, kind='stable')
    order = order[value[order] > _QUALITY * strength.max()]
    y = (order // columns) * cell + best[order] // cell
    x = (order % columns) * cell + best[order] % cell
    return (np.stack([x, y], axis=1)[:, None] * 2 + 0.5).astype(np.float32)


def _camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    if len(before) < _LEAST_AROUND:
        return None
    shift = np.linalg.norm((after - before).reshape(-1, 2), axis=1)
    if np.median(shift) < _STILL_PX:
        return None
    # Corner positions of LK are pixel indices; ours are positions, half a pixel further.
    transform, _ = cv2.estimateAffinePartial2D(
        before + 0.5, after + 0.5, method=cv2.RANSAC, ransacReprojThreshold=_RANSAC_PX
    )
    return None if transform is None else np.asarray(transform, np.float64)


def _median_shift(shift: NDArray[np.float32]) -> tuple[float, float] | None:
    if len(shift) < _LEAST_ON_BODY:
        return None
    median = np.median(shift, axis=0)
    return float(median[0]), float(median[1])
