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
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import compose

__all__ = ['Motion', 'MotionEstimator']

_CORNERS_AROUND = 64
_CORNERS_ON_BODY = 24
_LEAST_AROUND = 8
_LEAST_ON_BODY = 6
_STILL_PX = 0.2
_RANSAC_PX = 1.5
_SAMPLES = 100
_CELL_AROUND, _CELL_ON_BODY = 8, 6
"""Sides of the cells with one corner each, in pixels of half the size and of full size."""

_QUALITY = 0.01
"""Least strength of a corner, as a share of the strongest."""

_LEAST_STRENGTH = 2e-4
"""
Least strength of a corner of the world; noise of 5 grey levels, also along a straight edge,
reaches it.  On the body weak corners are better than none: their median is taken.
"""

_LEAST_APART = 16
"""Pixels between two corners that a motion may be estimated from."""

_MOST_TURN, _MOST_ZOOM = 0.2, 1.2
"""Largest rotation (radians) and zoom from frame to frame that are believed."""

_LEAST_AGREEING = 1 / 3
"""Share of the corners that must agree on the camera's motion; else it counts as unknown."""

_FOLLOWED = 4
"""Frames for which corners of the world are followed before new ones are sought."""

_LEAST_FOLLOWED = 40
"""Fewer corners of the world than this are replaced at once."""

_WINDOW_WORLD, _WINDOW_BODY = 11, 11
_LEVELS_WORLD, _LEVELS_BODY = 3, 2
_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 10, 0.02)
_AWAY = np.ones((9, 9), np.uint8)
_INNER = np.ones((5, 5), np.uint8)
"""Corners at the outline belong to the surroundings as much as to the body."""

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
        moved = self.camera[:, :2] @ np.array([x, y]) + self.camera[:, 2]
        return float(moved[0]), float(moved[1])


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
            points = _strongest(strength, allowed, _CELL_AROUND, _LEAST_STRENGTH)[:_CORNERS_AROUND]
            self._age = 0
        self._age += 1
        before, after = _followed(last, now, points, _WINDOW_WORLD, _LEVELS_WORLD)
        height, width = now.shape
        limit = np.array([width, height], np.float32)
        self._around = after[((after >= 0) & (after < limit)).all(axis=1)]
        return _camera_motion(2 * before, 2 * after)


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


def _followed(
    last: NDArray[np.uint8],
    now: NDArray[np.uint8],
    points: NDArray[np.float32],
    side: int,
    levels: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where points of the last frame were and are now, (n, 2) float32, the found ones."""
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


def _body_shift(
    last: NDArray[np.uint8],
    gray: NDArray[np.uint8],
    body: NDArray[np.uint8],
    camera: NDArray[np.float64] | None,
) -> tuple[float, float] | None:
    """Return the median shift of the corners on the body, sought about the camera's motion."""
    left, top, width, height = cv2.boundingRect(body)
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
    strength = cv2.cornerMinEigenVal(then, 3)
    where = cv2.erode(body[y_low:y_high, x_low:x_high], _INNER)
    points = _strongest(strength, where, _CELL_ON_BODY, 0.0)[:_CORNERS_ON_BODY]
    before, after = _followed(then, now, points, _WINDOW_BODY, _LEVELS_BODY)
    if len(before) < _LEAST_ON_BODY:
        return None
    median = np.median(after - before, axis=0)
    return dx + float(median[0]), dy + float(median[1])


def _common(low: int, high: int, shift: int, size: int) -> tuple[int, int]:
    """Return a range with margin that lies in 0..size also when shifted."""
    low, high = low - _BODY_MARGIN, high + _BODY_MARGIN
    return max(low, 0, -shift), min(high, size, size - shift)


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


def _strongest(
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


def _camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """Return the similarity that most points agree on, None if they stand still or are few."""
    if len(before) < _LEAST_AROUND:
        return None
    shift = np.hypot(*(after - before).T)
    if np.partition(shift, len(shift) // 2)[len(shift) // 2] < _STILL_PX:
        return None
    return _similarity(before, after)


def _similarity(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the 2 x 3 similarity that most pairs of points agree on (RANSAC), least squares.

    :param before, after: (n, 2) float32, n >= 2.
    """
    transform = np.empty((2, 3))
    found = _agreed(before.astype(np.float64), after.astype(np.float64), transform)
    return transform if found else None


@njit(cache=True, nogil=True)
def _agreed(
    then: NDArray[np.float64], now: NDArray[np.float64], transform: NDArray[np.float64]
) -> bool:
    """Fill in the similarity; return whether any two points agree on one."""
    tolerance = _RANSAC_PX * _RANSAC_PX
    agree, most = _consensus(then, now, _SAMPLES, tolerance)
    for _ in range(2):
        if most < max(2, _LEAST_AGREEING * agree.size):
            return False
        a, b, x, y = _fitted(then, now, agree)
        most = _agreement(then, now, a, b, x, y, tolerance, agree)
    transform[0, 0], transform[0, 1], transform[0, 2] = a, -b, x
    transform[1, 0], transform[1, 1], transform[1, 2] = b, a, y
    return True


@njit(cache=True, nogil=True)
def _agreement(
    then: NDArray[np.float64],
    now: NDArray[np.float64],
    a: float,
    b: float,
    x: float,
    y: float,
    tolerance: float,
    agree: NDArray[np.bool_],
) -> int:
    """Mark the points that a similarity takes to where they are now; return how many."""
    count = 0
    for k in range(agree.size):
        off_x = a * then[k, 0] - b * then[k, 1] + x - now[k, 0]
        off_y = b * then[k, 0] + a * then[k, 1] + y - now[k, 1]
        agree[k] = off_x * off_x + off_y * off_y < tolerance
        count += agree[k]
    return count


@njit(cache=True, nogil=True)
def _consensus(
    then: NDArray[np.float64], now: NDArray[np.float64], samples: int, tolerance: float
) -> tuple[NDArray[np.bool_], int]:
    """Return which points agree with the best of some similarities through two of them."""
    count = then.shape[0]
    best, agree = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    most = 0
    state = np.uint32(1)
    for _ in range(samples):
        # A linear congruential generator (Numerical Recipes): the same samples in every run.
        state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
        first = int(state >> np.uint32(8)) % count
        state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
        second = int(state >> np.uint32(8)) % count
        dx, dy = then[second, 0] - then[first, 0], then[second, 1] - then[first, 1]
        square = dx * dx + dy * dy
        if square < _LEAST_APART * _LEAST_APART:
            continue
        to_x, to_y = now[second, 0] - now[first, 0], now[second, 1] - now[first, 1]
        a, b = (dx * to_x + dy * to_y) / square, (dx * to_y - dy * to_x) / square
        size = a * a + b * b
        if abs(b) > _MOST_TURN or not 1 / _MOST_ZOOM**2 < size < _MOST_ZOOM**2:
            continue
        x = now[first, 0] - a * then[first, 0] + b * then[first, 1]
        y = now[first, 1] - b * then[first, 0] - a * then[first, 1]
        agreeing = _agreement(then, now, a, b, x, y, tolerance, agree)
        if agreeing > most:
            most = agreeing
            best[:] = agree
    return best, most


@njit(cache=True, nogil=True)
def _fitted(
    then: NDArray[np.float64], now: NDArray[np.float64], use: NDArray[np.bool_]
) -> tuple[float, float, float, float]:
    """Return a, b, x, y of the least-squares similarity ((a, -b, x), (b, a, y))."""
    count = 0
    from_x = from_y = to_x = to_y = 0.0
    for k in range(use.size):
        if use[k]:
            count += 1
            from_x += then[k, 0]
            from_y += then[k, 1]
            to_x += now[k, 0]
            to_y += now[k, 1]
    from_x, from_y, to_x, to_y = from_x / count, from_y / count, to_x / count, to_y / count
    square = dot = cross = 0.0
    for k in range(use.size):
        if use[k]:
            dx, dy = then[k, 0] - from_x, then[k, 1] - from_y
            ex, ey = now[k, 0] - to_x, now[k, 1] - to_y
            square += dx * dx + dy * dy
            dot += dx * ex + dy * ey
            cross += dx * ey - dy * ex
    a, b = (dot / square, cross / square) if square > 0 else (1.0, 0.0)
    return a, b, to_x - a * from_x + b * from_y, to_y - b * from_x - a * from_y
