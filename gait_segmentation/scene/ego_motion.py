# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Motion of the world, as the camera moves, and of bodies, from sparse optical flow.

Points are followed by the pyramidal Lucas-Kanade method: corners away from people give the
camera's motion as a robust homography, points on the person the body's shift.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, bounding_box, median
from gait_segmentation.scene.working import Pyramid

_MOST_OF_WORLD, _ON_BODY = 128, 32
"""Corners that are sought of the world, and about how many points of a body are followed."""

_LEAST_POINTS = 8
"""Points that are needed to tell the motion of a world or a body."""

_WORLD_APART = 8
"""Least distance between two corners of the world, in pixels of half the size."""

_LEAST_STRENGTH = 2e-4
"""
Least strength of a corner of the world; noise of 5 grey levels, also along a straight edge,
reaches it.  On the body points of a grid are followed, corners or not: their median is taken.
"""

_FOLLOWED = 8
"""Frames for which corners of the world are followed before new ones are sought."""

_ASTRAY_PX = 1.0
"""
How far off a point of a body may end when it is followed back: the window about a point of a small
body is larger than the body, and follows what is behind it.
"""

_SIDE = 11
"""Side of the window about a point that is compared, in pixels."""

_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 10, 0.02)
"""Steps, and the length of a step (pixels) that is the last."""

_STILL_PX = 0.2
"""Median shift up to which points stand still."""

_REACH_PX = 0.5
"""How far off a point may be that still counts: little, or slow walkers pull the world along."""

_MOST_SAMPLES = 100
"""Pairs of points tried."""

_LEAST_AGREEING = 1 / 3
"""Share of the corners that must agree on the camera's motion; else it counts as unknown."""

_STILL = np.eye(3)

_Pixel = TypeVar('_Pixel', np.uint8, np.float32)

_LEVELS_WORLD, _LEVELS_BODY = range(1, 5), range(3)

_AWAY = np.ones((9, 9), np.uint8)
"""How far corners of the world are away from people, in pixels of half the size."""

_INNER = np.ones((5, 5), np.uint8)
"""What is at the outline belongs to the surroundings as much as to the body."""


@dataclass(frozen=True)
class WorldMotion:
    """
    How the still world moved from an earlier frame to a later one, in working pixels.

    ``camera`` is the 3 x 3 homography of its positions, None when it did not move.
    """

    camera: NDArray[np.float64] | None = None

    @classmethod
    def over(cls, steps: Iterable[WorldMotion]) -> WorldMotion:
        """
        Return the motion over several frames.

        :param steps: from each frame to the next, oldest first.
        """
        total = None
        for step in steps:
            if step.camera is not None:
                total = step.camera if total is None else step.camera @ total
        return cls(total)

    def carry(self, x: float, y: float) -> tuple[float, float]:
        """Return where a position of the world moved to."""
        if self.camera is None:
            return x, y
        # In plain numbers, which is faster.
        (a, b, c), (d, e, f), (g, h, i) = self.camera.tolist()
        depth = g * x + h * y + i
        return (a * x + b * y + c) / depth, (d * x + e * y + f) / depth

    def inverse(self) -> WorldMotion:
        """Return how the world moved from the later frame to the earlier one."""
        return self if self.camera is None else WorldMotion(np.asarray(np.linalg.inv(self.camera)))

    def scaled(self, across: float, down: float) -> WorldMotion:
        """Return it in the pixels of an image so many times as wide and as high."""
        if self.camera is None:
            return self
        scale = np.array([across, down, 1.0])
        return WorldMotion(scale[:, None] * self.camera / scale)

    def warped(
        self,
        image: NDArray[_Pixel],
        window: Window,
        border: int = cv2.BORDER_REPLICATE,
        interpolation: int = cv2.INTER_LINEAR,
    ) -> NDArray[_Pixel]:
        """
        Return a window of an image of the earlier frame as it looks in the later one.

        :param image: (H, W) or (H, W, C) uint8 or float32.
        :param window: the rows and columns to compute.
        :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
        :param interpolation: a ``cv2.INTER_`` constant.
        """
        camera = _STILL if self.camera is None else self.camera
        rows, columns = window
        inside = rows.stop <= image.shape[0] and columns.stop <= image.shape[1]
        if inside and (camera == _STILL).all():
            return image[window].copy()
        size = (columns.stop - columns.start, rows.stop - rows.start)
        if min(size) <= 0:
            # OpenCV would take the image's size.
            return np.empty((max(size[1], 0), max(size[0], 0), *image.shape[2:]), image.dtype)
        # From positions to indices of pixels, whose centres are half a pixel on.
        left, top = columns.start + 0.5, rows.start + 0.5
        matrix = np.array([[1, 0, -left], [0, 1, -top], [0, 0, 1]]) @ camera
        matrix = matrix @ [[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]]
        return np.asarray(
            cv2.warpPerspective(image, matrix, size, flags=interpolation, borderMode=border)
        )


class MotionEstimator:
    """
    Follows corners from one frame to the next.

    The world is followed from half the size on, where far is near and a tenth of a pixel is still
    seen; the body from full size on, about where the camera's motion takes it.
    """

    def __init__(self) -> None:
        """Start without a last frame."""
        self._last: Pyramid | None = None
        self._now: Pyramid | None = None
        self._corners = np.empty((0, 2), np.float32)
        """(n, 2) float32, positions (x, y) of the world's corners that are followed."""

        self._age = 0

    def update(self, frame: Pyramid) -> None:
        """Take in the brightness of a frame, from which on motion is told if it shows anything."""
        self._last, self._now = (None, self._now) if frame.is_blank else (self._now, frame)
        if self._last is not None and self._last.shape != frame.shape:
            self._last = None

    def leave_out(self) -> None:
        """Take the newest frame for one in which nothing can be seen."""
        self._last, self._now = None, self._last
        self._corners = self._corners[:0]

    def body_shift(
        self,
        body: NDArray[np.uint8],
        motion: WorldMotion,
        velocity: tuple[float, float] = (0.0, 0.0),
        corner: tuple[int, int] = (0, 0),
    ) -> tuple[float, float] | None:
        """
        Return the shift of a body between the last two frames, None if it is not known.

        :param body: (h, w) uint8 of the frame before the last, non-zero on the person; the part
            of the image from some row and column on, ``corner``.
        :param motion: of the world between the two.
        :param velocity: shift against the still world that is expected; fast bodies are
            followed from there.
        """
        first, start, width, height = bounding_box(body)
        if self._last is None or self._now is None or width == 0:
            return None
        left, top = corner[1] + first, corner[0] + start
        x, y = left + width / 2, top + height / 2
        stays_x, stays_y = motion.carry(x, y)
        expected = (stays_x - x + velocity[0], stays_y - y + velocity[1])
        inner = cv2.erode(body[start : start + height, first : first + width], _INNER)
        apart = max(round((np.count_nonzero(inner) / _ON_BODY) ** 0.5), 1)
        rows, columns = np.nonzero(inner[apart // 2 :: apart, apart // 2 :: apart])
        points = apart * np.column_stack([columns, rows]) + (left + apart // 2, top + apart // 2)
        points = points.astype(np.float32) + np.float32(0.5)
        before, after = followed(
            self._last, self._now, points, _LEVELS_BODY, expected, astray=_ASTRAY_PX
        )
        if len(before) < _LEAST_POINTS:
            return None
        x, y = median(after - before).tolist()
        return x, y

    def world_motion(self, people: NDArray[np.uint8]) -> WorldMotion:
        """
        Return the motion between the last two frames in which anything can be seen.

        :param people: (h, w) uint8 of the first one, non-zero where people may be; corners of the
            still world are taken elsewhere.
        """
        last, now = self._last, self._now
        if last is None or now is None:
            self._corners = self._corners[:0]
            return WorldMotion()
        half = last.image(_LEVELS_WORLD.start)
        free = people[: 2 * half.shape[0] : 2, : 2 * half.shape[1] : 2] == 0
        where = cv2.erode(free.view(np.uint8), _AWAY)
        columns, rows = (self._corners / 2).astype(int).T
        points = self._corners[where[rows, columns] > 0]
        if self._age >= _FOLLOWED or len(points) < _LEAST_POINTS:
            points = 2 * _corners_of(half, where)
            self._age = 0
        self._age += 1
        before, after = followed(last, now, points, _LEVELS_WORLD)
        # Only inside of what is left of the image at half the size.
        limit = np.array([2 * (size // 2) for size in now.shape[::-1]], np.float32)
        self._corners = after[((after >= 0) & (after < limit)).all(axis=1)]
        return WorldMotion(camera_motion(before, after))


def _corners_of(gray: NDArray[np.uint8], where: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the strongest corners by Shi and Tomasi, (n, 2) float32, positions (x, y)."""
    # Strong enough is what is strong by itself, not next to the strongest.
    corners, strength = cv2.goodFeaturesToTrackWithQuality(
        gray, _MOST_OF_WORLD, 1e-6, _WORLD_APART, where
    )
    if corners is None:
        return np.empty((0, 2), np.float32)
    found = corners.reshape(-1, 2)[strength.ravel() > _LEAST_STRENGTH]
    # Positions count from the border of the first pixel, OpenCV's from its centre.
    return np.asarray(found + np.float32(0.5))


def followed(
    last: Pyramid,
    now: Pyramid,
    points: NDArray[np.float32],
    levels: range,
    expected: tuple[float, float] = (0.0, 0.0),
    *,
    astray: float | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """
    Follow points by the pyramidal method of Lucas and Kanade.

    :param last, now: two frames.
    :param points: (n, 2) float32, positions (x, y) in the last frame.
    :param levels: of the pyramids to use, the largest image first.
    :param expected: shift (x, y) in pixels about which they are sought.
    :param astray: distance in pixels from where a point began that it may end at when it is
        followed back; None: this is not tried (Kalal, Mikolajczyk and Matas, ICPR 2010).
    :returns: where those that were found were and are now, (m, 2) float32 each.
    """
    after, found = _follow(last, now, points, levels, expected)
    before, after = points[found], after[found]
    if astray is not None:
        again, found = _follow(now, last, after, levels, (-expected[0], -expected[1]))
        found &= np.hypot(*(again - before).T) < astray
        before, after = before[found], after[found]
    return before, after


def _follow(
    last: Pyramid,
    now: Pyramid,
    points: NDArray[np.float32],
    levels: range,
    expected: tuple[float, float],
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return where points are now, (n, 2) float32, and (n,) bool, whether that is known."""
    if len(points) == 0:
        return points, np.zeros(0, np.bool_)
    scale, levels_up = np.float32(0.5**levels.start), len(levels) - 1
    before = scale * points - np.float32(0.5)
    after = before + scale * np.array(expected, np.float32)
    image, later = (frame.image(levels.start) for frame in (last, now))
    # Only the part of the images that the points need.
    size, margin = np.array(image.shape[::-1]), _SIDE << levels_up
    low = np.minimum(before, after).min(axis=0) - margin
    high = np.maximum(before, after).max(axis=0) + margin
    low = np.clip(low, 0, size - 1).astype(int)
    high = np.clip(high, low + 1, size).astype(int)
    window, corner = np.s_[low[1] : high[1], low[0] : high[0]], low.astype(np.float32)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        image[window],
        later[window],
        before - corner,
        after - corner,
        winSize=(_SIDE, _SIDE),
        maxLevel=levels_up,
        criteria=_UNTIL,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray((moved + corner + np.float32(0.5)) / scale), found.ravel() > 0


def camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the homography that most points agree on, None if they stand still or are few.

    That is how a still world looks to a camera that turns, and a plane to any camera.

    :param before, after: (n, 2) float32, positions (x, y) of the same points in two frames.
    :returns: 3 x 3 homography of positions.
    """
    if len(before) < _LEAST_POINTS or median(np.hypot(*(after - before).T)) < _STILL_PX:
        return None
    # OpenCV draws the same samples in every call.
    motion, agrees = cv2.findHomography(
        before, after, cv2.USAC_FAST, _REACH_PX, maxIters=_MOST_SAMPLES
    )
    least = max(_LEAST_POINTS, _LEAST_AGREEING * len(before))
    return None if motion is None or np.count_nonzero(agrees) < least else np.asarray(motion)
