# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Motion of the camera and of the body between two frames, from sparse optical flow.

Points are followed by the pyramidal Lucas-Kanade method: corners away from people give the
camera's motion as a robust similarity, points on the person the body's shift.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import bounding_box
from gait_segmentation.medians import median
from gait_segmentation.scene.ego_motion.flow import camera_motion, corners_of, followed
from gait_segmentation.scene.ego_motion.pyramid import Pyramid
from gait_segmentation.scene.ego_motion.world_motion import WorldMotion

__all__ = ['MotionEstimator']

_MOST_OF_WORLD, _ON_BODY = 64, 32
"""Corners that are sought of the world, and about how many points of a body are followed."""

_LEAST_OF_BODY = 6
"""Fewer that were found again on a body do not tell its shift."""

_WORLD_APART, _BODY_APART = 8, 3
"""
Least distances between two corners of the world, in pixels of half the size, and between two
points of a body.
"""

_LEAST_STRENGTH = 2e-4
"""
Least strength of a corner of the world; noise of 5 grey levels, also along a straight edge,
reaches it.  On the body points of a grid are followed, corners or not: their median is taken.
"""

_FOLLOWED = 8
"""Frames for which corners of the world are followed before new ones are sought."""

_LEAST_FOLLOWED = 40
"""Fewer corners of the world than this are replaced at once."""

_ASTRAY_PX = 1.0
"""
How far off a point of a body may end when it is followed back: the window about a point of a small
body is larger than the body, and follows what is behind it.
"""

_LEVELS_WORLD, _LEVELS_BODY = range(1, 5), range(3)
_AWAY = 4
"""Pixels of half the size that corners of the world are away from people."""

_INNER = np.ones((5, 5), np.uint8)
"""What is at the outline belongs to the surroundings as much as to the body."""


class MotionEstimator:
    """
    Follows corners from one frame to the next.

    The world is followed from half the size on, where far is near and a tenth of a pixel is still
    seen; the body from full size on, about where the camera's motion takes it.
    """

    def __init__(self) -> None:
        """Start without a last frame."""
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: Pyramid | None = None
        self._now: Pyramid | None = None
        self._corners = np.empty((0, 2), np.float32)
        """(n, 2) float32, positions (x, y) of the world's corners that are followed."""

        self._age = 0

    def update(
        self,
        frame: Pyramid,
        people: NDArray[np.uint8] | None,
        *,
        camera: bool = True,
    ) -> WorldMotion:
        """
        Measure the motion since the last frame in which anything can be seen.

        :param frame: the brightness of this frame, (h, w) at full size.
        :param people: (h, w) uint8 of the last frame, non-zero where people may be; corners of
            the still world are taken elsewhere.
        :param camera: whether to estimate the motion of the camera.
        """
        if frame.is_blank:
            self._last = None
            return WorldMotion()
        self._last, self._now = self._now, frame
        if self._last is None or self._last.shape != frame.shape:
            self._last = None
            self._corners = self._corners[:0]
            return WorldMotion()
        return WorldMotion(self._follow_world(self._last, frame, people) if camera else None)

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
        if self._last is None or self._now is None:
            return None
        return _body_shift(self._last, self._now, body, motion, velocity, corner)

    def _follow_world(
        self, last: Pyramid, now: Pyramid, people: NDArray[np.uint8] | None
    ) -> NDArray[np.float64] | None:
        """Return the camera's motion."""
        half = last.image(_LEVELS_WORLD.start)
        where = _away_from(people, half.shape)
        columns, rows = (self._corners / 2).astype(int).T
        points = self._corners[where[rows, columns] > 0]
        if self._age >= _FOLLOWED or len(points) < _LEAST_FOLLOWED:
            points = 2 * corners_of(half, where, _WORLD_APART, _MOST_OF_WORLD, _LEAST_STRENGTH)
            self._age = 0
        self._age += 1
        before, after = followed(last, now, points, _LEVELS_WORLD)
        # Only inside of what is left of the image at half the size.
        limit = np.array([2 * (size // 2) for size in now.shape[::-1]], np.float32)
        self._corners = after[((after >= 0) & (after < limit)).all(axis=1)]
        return camera_motion(before, after)


def _away_from(people: NDArray[np.uint8] | None, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return, at half the size, what is not 0 away from people."""
    if people is None:
        return np.ones(shape, np.uint8)
    free = people[: 2 * shape[0] : 2, : 2 * shape[1] : 2] == 0
    side = 2 * _AWAY + 1
    return cv2.erode(free.view(np.uint8), np.ones((side, side), np.uint8))


def _body_shift(
    last: Pyramid,
    now: Pyramid,
    body: NDArray[np.uint8],
    motion: WorldMotion,
    velocity: tuple[float, float],
    corner: tuple[int, int],
) -> tuple[float, float] | None:
    """Return the median shift of points on the body, sought about the expected one."""
    first, start, width, height = bounding_box(body)
    if width == 0:
        return None
    body = body[start : start + height, first : first + width]
    left, top = corner[1] + first, corner[0] + start
    x, y = left + width / 2, top + height / 2
    stays_x, stays_y = motion.carry(x, y)
    expected = (stays_x - x + velocity[0], stays_y - y + velocity[1])
    inner = cv2.erode(body, _INNER)
    apart = max(round((np.count_nonzero(inner) / _ON_BODY) ** 0.5), _BODY_APART)
    rows, columns = np.nonzero(inner[apart // 2 :: apart, apart // 2 :: apart])
    points = apart * np.column_stack([columns, rows]) + (left + apart // 2, top + apart // 2)
    points = points.astype(np.float32) + np.float32(0.5)
    before, after = followed(last, now, points, _LEVELS_BODY, expected, astray=_ASTRAY_PX)
    if len(before) < _LEAST_OF_BODY:
        return None
    x, y = median(after - before).tolist()
    return x, y
