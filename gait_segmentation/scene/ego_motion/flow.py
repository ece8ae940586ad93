# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Corners of a frame, where they are in the next one, and the motion that most agree on."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.scene.ego_motion.pyramid import Pyramid

__all__ = ['camera_motion', 'corners_of', 'followed']

_QUALITY = 0.01
"""Least strength of a corner, as a share of the strongest."""

_SIDE = 11
"""Side of the window about a point that is compared, in pixels."""

_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 10, 0.02)
"""Steps, and the length of a step (pixels) that is the last."""

_LEAST_POINTS = 8
_STILL_PX = 0.2
"""Points that are needed, and the median shift up to which they stand still."""

_REACH_PX = 0.75
"""How far off a point may be that still counts: little, or slow walkers pull the world along."""

_MOST_SAMPLES = 100
"""Pairs of points tried."""

_MOST_TURN, _MOST_ZOOM = 0.2, 1.2
"""Largest rotation (radians) and zoom from frame to frame that are believed."""

_LEAST_AGREEING = 1 / 3
"""Share of the corners that must agree on the camera's motion; else it counts as unknown."""


def corners_of(
    gray: NDArray[np.uint8],
    where: NDArray[np.uint8],
    apart: float,
    most: int,
    least: float = 0.0,
) -> NDArray[np.float32]:
    """
    Return the strongest corners of an image by Shi and Tomasi, strongest first.

    :param gray: (h, w) uint8.
    :param where: (h, w) uint8, non-zero where corners may lie.
    :param apart: least distance between two, in pixels.
    :param most: corners wanted.
    :param least: strength that a corner must have more than (``cv2.cornerMinEigenVal``).
    :returns: (n, 2) float32, positions (x, y).
    """
    if gray.size == 0:
        return np.empty((0, 2), np.float32)
    corners, strength = cv2.goodFeaturesToTrackWithQuality(gray, most, _QUALITY, apart, where)
    if corners is None:
        return np.empty((0, 2), np.float32)
    found = corners.reshape(-1, 2)[strength.ravel() > least]
    # Positions count from the border of the first pixel, OpenCV's from its centre.
    return np.asarray(found + np.float32(0.5))


def followed(
    last: Pyramid,
    now: Pyramid,
    points: NDArray[np.float32],
    levels: range,
    expected: tuple[float, float] = (0.0, 0.0),
    *,
    astray: float = math.inf,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """
    Follow points by the pyramidal method of Lucas and Kanade.

    :param last, now: two frames.
    :param points: (n, 2) float32, positions (x, y) in the last frame.
    :param levels: of the pyramids to use, the largest image first.
    :param expected: shift (x, y) in pixels about which they are sought.
    :param astray: distance in pixels from where a point began that it may end at when it is
        followed back; by default this is not tried (Kalal, Mikolajczyk and Matas, ICPR 2010).
    :returns: where those that were found were and are now, (m, 2) float32 each.
    """
    if len(points) == 0:
        return points, points
    after, found = _follow(last, now, points, levels, expected)
    if math.isfinite(astray):
        again, back = _follow(now, last, after, levels, (-expected[0], -expected[1]))
        found &= back & (np.hypot(*(again - points).T) < astray)
    return points[found], after[found]


def _follow(
    last: Pyramid,
    now: Pyramid,
    points: NDArray[np.float32],
    levels: range,
    expected: tuple[float, float],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return where points are now, (n, 2) float32, and (n,) bool, whether that is known."""
    scale, levels_up = np.float32(0.5**levels.start), len(levels) - 1
    before = scale * points - np.float32(0.5)
    after = before + scale * np.array(expected, np.float32)
    image = last.image(levels.start)
    window, corner = _about(before, after, _SIDE << levels_up, image.shape)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        image[window],
        now.image(levels.start)[window],
        before - corner,
        after - corner,
        winSize=(_SIDE, _SIDE),
        maxLevel=levels_up,
        criteria=_UNTIL,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray((moved + corner + np.float32(0.5)) / scale), found.ravel() > 0


def _about(
    before: NDArray[np.float32], after: NDArray[np.float32], margin: int, shape: tuple[int, ...]
) -> tuple[Window, NDArray[np.float32]]:
    """Return the part of an image of a shape that points need, and its first column and row."""
    both = np.concatenate([before, after])
    low, high = np.fmin.reduce(both).tolist(), np.fmax.reduce(both).tolist()
    columns, rows = (
        _stretch(first - margin, last + margin, size)
        for first, last, size in zip(low, high, shape[::-1], strict=True)
    )
    return (rows, columns), np.array([columns.start, rows.start], np.float32)


def _stretch(first: float, last: float, size: int) -> slice:
    """Return what of a size lies between two places, at least one pixel, also if they are NaN."""
    start = int(min(max(0.0, first), size - 1))
    return slice(start, int(min(max(start + 1, last), size)))


def camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the similarity that most points agree on, None if they stand still or are few.

    :param before, after: (n, 2) float32, positions (x, y) of the same points in two frames.
    :returns: 2 x 3 transform of positions.
    """
    if len(before) < _LEAST_POINTS:
        return None
    shift = np.hypot(*(after - before).T)
    if np.partition(shift, len(shift) // 2)[len(shift) // 2] < _STILL_PX:
        return None
    # OpenCV draws the same samples in every call.
    motion, agrees = cv2.estimateAffinePartial2D(
        before, after, ransacReprojThreshold=_REACH_PX, maxIters=_MOST_SAMPLES
    )
    if motion is None or np.count_nonzero(agrees) < _LEAST_AGREEING * len(before):
        return None
    zoom = np.hypot(motion[0, 0], motion[1, 0])
    if abs(motion[1, 0]) > _MOST_TURN or not 1 / _MOST_ZOOM < zoom < _MOST_ZOOM:
        return None
    return np.asarray(motion)
