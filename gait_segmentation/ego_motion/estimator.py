# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Motion of the camera and of the body between two frames, from sparse optical flow.

Corners are followed by the pyramidal Lucas-Kanade method; those away from people give the
camera's motion as a robust similarity, those on the person the body's shift.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.corners import followed, strongest
from gait_segmentation.ego_motion.similarity import camera_motion
from gait_segmentation.geometry import compose
from gait_segmentation.images import bounding_box

__all__ = ['Motion', 'MotionEstimator']

_CORNERS_AROUND = 64
_CORNERS_ON_BODY = 24
_LEAST_ON_BODY = 6
_CELL_AROUND, _CELL_ON_BODY = 8, 6
"""Sides of the cells with one corner each, in pixels of half the size and of full size."""

_LEAST_STRENGTH = 2e-4
"""
Least strength of a corner of the world; noise of 5 grey levels, also along a straight edge,
reaches it.  On the body weak corners are better than none: their median is taken.
"""

_FOLLOWED = 4
"""Frames for which corners of the world are followed before new ones are sought."""

_LEAST_FOLLOWED = 40
"""Fewer corners of the world than this are replaced at once."""

_WINDOW_WORLD, _WINDOW_BODY = 11, 11
_LEVELS_WORLD, _LEVELS_BODY = 3, 2
_AWAY = np.ones((9, 9), np.uint8)
_INNER = np.ones((5, 5), np.uint8)
"""Corners at the outline belong to the surroundings as much as to the body."""

_ABOUT_CORNER = 3
"""Pixels about a corner that its strength depends on."""

_BODY_MARGIN = 16
"""Pixels about the body that its corners may be looked for in, beside the expected shift."""


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

    def corrected(self, shift: tuple[float, float] | None) -> Motion:
        """Return the motion with a further shift of the still world, if there is one."""
        if shift is None:
            return self
        step = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
        return replace(self, camera=step if self.camera is None else compose(step, self.camera))

    def carry(self, x: float, y: float) -> tuple[float, float]:
        """Return where the camera's motion moves a position of the still world."""
        if self.camera is None:
            return x, y
        (a, b, dx), (c, d, dy) = self.camera.tolist()
        return a * x + b * y + dx, c * x + d * y + dy


class MotionEstimator:
    """
    Follows corners from one frame to the next.

    The world is followed at half the size, where far is near and a tenth of a pixel is still
    seen; the body at full size, in a cut-out about it that is already shifted as expected.
    """

    def __init__(self) -> None:
        """Start without a last frame."""
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: NDArray[np.uint8] | None = None
        self._gray: NDArray[np.uint8] | None = None
        self._half: NDArray[np.uint8] | None = None
        self._around = np.empty((0, 2), np.float32)
        self._age = 0

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
        last_half = self._half
        self._last, self._gray, self._half = self._gray, gray, _halved(gray)
        if self._last is None or last_half is None or self._last.shape != gray.shape:
            self._last = None
            self._around = self._around[:0]
            return Motion(None, None)
        transform = self._follow_world(last_half, self._half, people) if camera else None
        return Motion(transform, None if body is None else self.body_shift(body, transform))

    def body_shift(
        self, body: NDArray[np.uint8], camera: NDArray[np.float64] | None
    ) -> tuple[float, float] | None:
        """
        Return the shift of one more body between the last two frames, None if it is not known.

        :param body: (h, w) uint8 of the frame before the last, non-zero on the person.
        :param camera: the camera's motion between the two, as :meth:`update` returned it.
        """
        if self._last is None or self._gray is None:
            return None
        return _body_shift(self._last, self._gray, body, camera)

    def _follow_world(
        self, last: NDArray[np.uint8], now: NDArray[np.uint8], people: NDArray[np.uint8] | None
    ) -> NDArray[np.float64] | None:
        """
        Return the camera's motion at full size.

        :param last, now: the frames at half size.
        """
        points = self._around
        allowed = np.full(last.shape, 255, np.uint8)
        if people is not None:
            # The neighbourhood that is compared must be free of people, too.
            allowed = cv2.erode(cv2.bitwise_not(_thinned(people, last.shape)), _AWAY)
            columns, rows = points.astype(np.intp).T
            points = points[allowed[rows, columns] != 0]
        if self._age >= _FOLLOWED or len(points) < _LEAST_FOLLOWED:
            strength = cv2.cornerMinEigenVal(last, 3)
            points = strongest(strength, allowed, _CELL_AROUND, _LEAST_STRENGTH)[:_CORNERS_AROUND]
            self._age = 0
        self._age += 1
        before, after = followed(last, now, points, _WINDOW_WORLD, _LEVELS_WORLD)
        height, width = now.shape
        limit = np.array([width, height], np.float32)
        self._around = after[((after >= 0) & (after < limit)).all(axis=1)]
        return camera_motion(2 * before, 2 * after)


def _halved(gray: NDArray[np.uint8]) -> NDArray[np.uint8]:
    size = (max(gray.shape[1] // 2, 1), max(gray.shape[0] // 2, 1))
    part = gray[: 2 * size[1], : 2 * size[0]]
    return np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA))


def _thinned(people: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return 0 or 255 of every second pixel."""
    part = np.ascontiguousarray(people[: 2 * shape[0] : 2, : 2 * shape[1] : 2])
    if part.shape != shape:
        part = cv2.resize(part, shape[::-1], interpolation=cv2.INTER_NEAREST)
    # Not cv2.compare: that takes an image of one pixel for something else.
    return np.asarray(cv2.inRange(part, 1, 255))


def _body_shift(
    last: NDArray[np.uint8],
    gray: NDArray[np.uint8],
    body: NDArray[np.uint8],
    camera: NDArray[np.float64] | None,
) -> tuple[float, float] | None:
    """Return the median shift of the corners on the body, sought about the camera's motion."""
    left, top, width, height = bounding_box(body)
    if width == 0:
        return None
    dx = dy = 0
    if camera is not None:
        center = np.array([left + width / 2, top + height / 2])
        dx, dy = np.rint(camera[:, :2] @ center + camera[:, 2] - center).astype(int).tolist()
    # Both cut-outs must lie in the image.
    x_low, x_high = _common(left, left + width, dx, gray.shape[1])
    y_low, y_high = _common(top, top + height, dy, gray.shape[0])
    if x_high - x_low < 3 or y_high - y_low < 3:
        return None
    then = np.ascontiguousarray(last[y_low:y_high, x_low:x_high])
    now = np.ascontiguousarray(gray[y_low + dy : y_high + dy, x_low + dx : x_high + dx])
    # Corners are sought on the body only, in cells that begin where the cut-out does.
    columns = _cells(left - x_low, width, then.shape[1])
    rows = _cells(top - y_low, height, then.shape[0])
    strength = cv2.cornerMinEigenVal(then[rows, columns], 3)
    where = cv2.erode(body[y_low:y_high, x_low:x_high][rows, columns], _INNER)
    points = strongest(strength, where, _CELL_ON_BODY, 0.0)[:_CORNERS_ON_BODY]
    points += np.array([columns.start, rows.start], np.float32)
    before, after = followed(then, now, points, _WINDOW_BODY, _LEVELS_BODY)
    if len(before) < _LEAST_ON_BODY:
        return None
    x, y = _median(after - before)
    return dx + x, dy + y


def _cells(start: int, length: int, size: int) -> slice:
    """Return whole cells of a line that hold a part of it and what its corners depend on."""
    cell = _CELL_ON_BODY
    low = max(start - _ABOUT_CORNER, 0) // cell * cell
    high = -(-(start + length + _ABOUT_CORNER) // cell) * cell
    return slice(low, min(high, size))


def _median(shifts: NDArray[np.float32]) -> tuple[float, float]:
    """Return the medians of two columns; for a few numbers numpy's own takes ten times as long."""
    ordered = np.sort(shifts, axis=0)
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    x, y = ((low + high) / np.float32(2)).tolist()
    return x, y


def _common(low: int, high: int, shift: int, size: int) -> tuple[int, int]:
    """Return a range with margin that lies in 0..size also when shifted."""
    low, high = low - _BODY_MARGIN, high + _BODY_MARGIN
    return max(low, 0, -shift), min(high, size, size - shift)
