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

_CORNERS_AROUND = 120
_CORNERS_ON_BODY = 60
_LEAST_AROUND = 8
_LEAST_ON_BODY = 6
_STILL_PX = 0.2
_RANSAC_PX = 1.5
_LK = {'winSize': (15, 15), 'maxLevel': 3}


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
        self._last: NDArray[np.uint8] | None = None

    def reset(self) -> None:
        """Forget the last frame."""
        self._last = None

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
        empty = np.empty((0, 1, 2), np.float32)
        around = _corners(last, people, _CORNERS_AROUND, True) if camera else empty
        on_body = _corners(last, body, _CORNERS_ON_BODY, False) if body is not None else empty
        points = np.concatenate([around, on_body])
        if len(points) == 0:
            return Motion(None, None)
        moved, found, _ = cv2.calcOpticalFlowPyrLK(last, gray, points, None, **_LK)
        good = found.ravel() == 1
        split = len(around)
        transform = _camera_motion(points[:split][good[:split]], moved[:split][good[:split]])
        shift = (moved - points)[split:][good[split:]].reshape(-1, 2)
        return Motion(transform, _median_shift(shift))


def _corners(
    gray: NDArray[np.uint8], mask: NDArray[np.uint8] | None, most: int, outside: bool
) -> NDArray[np.float32]:
    """Find corners at half size, where the search costs a quarter."""
    half = cv2.resize(gray, (gray.shape[1] // 2, gray.shape[0] // 2), interpolation=cv2.INTER_AREA)
    where = None
    if mask is not None:
        where = cv2.resize(mask, half.shape[::-1], interpolation=cv2.INTER_NEAREST)
        where = (where == 0 if outside else where != 0).astype(np.uint8)
    found = cv2.goodFeaturesToTrack(half, most, 0.01, 5 if outside else 3, mask=where)
    if found is None:
        return np.empty((0, 1, 2), np.float32)
    return np.asarray(found * 2 + 0.5, np.float32)


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
