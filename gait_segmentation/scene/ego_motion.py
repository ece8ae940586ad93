# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Motion of the camera and of the body between two frames, from sparse optical flow.

Points are followed by the pyramidal Lucas-Kanade method: corners away from people give the
camera's motion as a robust homography, points on the person the body's shift.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, bounding_box, median

LEAST_RANGE = 8  # grey levels between darkest and brightest cell; with fewer nothing can be seen
_HALVINGS = 3  # that make a cell a pixel
# Correlation of the cells of two pictures from which they may show the same place.
_SAME_PLACE = 0.5
_IDENTITY = np.eye(3)
# From positions to indices of pixels, whose centres are half a pixel on, and back.
_TO_INDEX = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]])
_FROM_INDEX = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
_Pixel = TypeVar('_Pixel', np.uint8, np.float32)
_MOST_OF_WORLD = 128  # corners that are sought
_ON_BODY = 32  # points that are followed, about
_LEAST_OF_BODY = 6  # fewer that were found again on a body do not tell its shift
# Least distances between two corners of the world, in pixels of half the size, and between two
# points of a body.
_WORLD_APART = 8
_BODY_APART = 3
# Least strength of a corner of the world; noise of 5 grey levels, also along a straight edge,
# reaches it.  On the body points of a grid are followed, corners or not: their median is taken.
_LEAST_STRENGTH = 2e-4
_FOLLOWED = 8  # frames for which corners of the world are followed before new ones are sought
_LEAST_FOLLOWED = 40  # fewer corners of the world than this are replaced at once
# How far off a point of a body may end when it is followed back: the window about a point of a
# small body is larger than the body, and follows what is behind it.
_ASTRAY_PX = 1.0
_QUALITY = 0.01  # least strength of a corner, as a share of the strongest
_COMPARED_PX = 11  # side of the window about a point that is compared, in pixels
# Steps, and the length of a step (pixels) that is the last.
_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 10, 0.02)
_LEAST_POINTS = 8  # fewer do not tell the camera's motion
_STILL_PX = 0.2  # median shift up to which they stand still
# How far off a point may be that still counts: little, or slow walkers pull the world along.
_REACH_PX = 0.5
_MOST_SAMPLES = 100  # pairs of points tried
# Largest rotation (radians) and zoom from frame to frame that are believed.
_MOST_TURN = 0.2
_MOST_ZOOM = 1.2
# Share of the corners that must agree on the camera's motion; else it counts as unknown.
_LEAST_AGREEING = 1 / 3
_WORLD_LEVELS = range(1, 5)
_BODY_LEVELS = range(3)
_FROM_PEOPLE = 4  # pixels of half the size that corners of the world are away from people
# What is at the outline belongs to the surroundings as much as to the body.
_INNER = np.ones((5, 5), np.uint8)


class Pyramid:
    """
    A grey image and smaller ones, each half the size of the one before, made when asked for.

    A position in the image times ``0.5**level`` is that in the image of a level.
    """

    def __init__(self, gray: NDArray[np.uint8]) -> None:
        """Begin with the image at full size, (h, w) uint8."""
        self._images = [gray]

    @property
    def shape(self) -> tuple[int, ...]:
        """Return (h, w) of the image at full size."""
        return self._images[0].shape

    def image(self, level: int) -> NDArray[np.uint8]:
        """Return the image halved as often as ``level`` says."""
        while len(self._images) <= level:
            gray = self._images[-1]
            # Means of 2 x 2 pixels, without the last row or column of an odd number.
            size = (max(gray.shape[1] // 2, 1), max(gray.shape[0] // 2, 1))
            part = gray[: 2 * size[1], : 2 * size[0]]
            self._images.append(np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA)))
        return self._images[level]

    @cached_property
    def is_blank(self) -> bool:
        """Return whether nothing can be seen, as when something covers the lens."""
        darkest, brightest, *_ = cv2.minMaxLoc(self.image(_HALVINGS))
        return brightest - darkest < LEAST_RANGE

    def resembles(self, other: Pyramid) -> bool:
        """Return whether another picture, of the same size, may show the same place."""
        # By means of cells, in which noise and texture are far less.
        cells = self.image(_HALVINGS), other.image(_HALVINGS)
        return float(cv2.matchTemplate(*cells, cv2.TM_CCOEFF_NORMED)[0, 0]) > _SAME_PLACE


@dataclass(frozen=True)
class WorldMotion:
    """
    How the still world moved from an earlier frame to a later one, in working pixels.

    ``camera`` is the 3 x 3 homography of its positions, None when it did not move.
    """

    camera: NDArray[np.float64] | None = None

    @classmethod
    def over(cls, steps: Iterable[WorldMotion]) -> WorldMotion:
        """Return the motion over several frames, from each to the next, oldest first."""
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
        :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
        """
        camera = _IDENTITY if self.camera is None else self.camera
        rows, columns = window
        inside = rows.stop <= image.shape[0] and columns.stop <= image.shape[1]
        if inside and (camera == _IDENTITY).all():
            return image[window].copy()
        size = (columns.stop - columns.start, rows.stop - rows.start)
        if min(size) <= 0:
            # OpenCV would take the image's size.
            return np.empty((max(size[1], 0), max(size[0], 0), *image.shape[2:]), image.dtype)
        matrix = _TO_INDEX @ camera @ _FROM_INDEX
        matrix[:2] -= np.outer((columns.start, rows.start), matrix[2])
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
        self._last: Pyramid | None = None
        self._now: Pyramid | None = None
        self._corners = np.empty((0, 2), np.float32)
        """(n, 2) float32, positions (x, y) of the world's corners that are followed."""

        self._age = 0

    def update(self, frame: Pyramid, people: NDArray[np.uint8] | None) -> WorldMotion:
        """
        Measure the motion since the last frame in which anything can be seen.

        :param people: (h, w) uint8 of the last frame, non-zero where people may be; corners of
            the still world are taken elsewhere, None if the camera is not to be followed.
        """
        if frame.is_blank:
            self._last = None
            return WorldMotion()
        self._last, self._now = self._now, frame
        if self._last is None or self._last.shape != frame.shape:
            self._last = None
            self._corners = self._corners[:0]
            return WorldMotion()
        return WorldMotion() if people is None else self._follow_world(self._last, frame, people)

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

        :param body: (h, w) uint8 of the earlier frame, non-zero on the person; the part of the
            image from some row and column on, ``corner``.
        :param velocity: expected shift against the still world, from where it is followed.
        """
        if self._last is None or self._now is None:
            return None
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
        after, found = followed(self._last, self._now, points, _BODY_LEVELS, expected)
        # And back (Kalal, Mikolajczyk and Matas, ICPR 2010).
        back = (-expected[0], -expected[1])
        again, found_again = followed(self._now, self._last, after, _BODY_LEVELS, back)
        found &= found_again & (np.hypot(*(again - points).T) < _ASTRAY_PX)
        if np.count_nonzero(found) < _LEAST_OF_BODY:
            return None
        x, y = median((after - points)[found]).tolist()
        return x, y

    def _follow_world(self, last: Pyramid, now: Pyramid, people: NDArray[np.uint8]) -> WorldMotion:
        half, side = last.image(_WORLD_LEVELS.start), 2 * _FROM_PEOPLE + 1
        free = people[: 2 * half.shape[0] : 2, : 2 * half.shape[1] : 2] == 0
        where = np.asarray(cv2.erode(free.view(np.uint8), np.ones((side, side), np.uint8)))
        columns, rows = (self._corners / 2).astype(int).T
        points = self._corners[where[rows, columns] > 0]
        if self._age >= _FOLLOWED or len(points) < _LEAST_FOLLOWED:
            points = 2 * _corners_of(half, where)
            self._age = 0
        self._age += 1
        after, found = followed(last, now, points, _WORLD_LEVELS)
        before, after = points[found], after[found]
        # Only inside of what is left of the image at half the size.
        limit = np.array([2 * (size // 2) for size in now.shape[::-1]], np.float32)
        self._corners = after[((after >= 0) & (after < limit)).all(axis=1)]
        return WorldMotion(camera_motion(before, after))


def _corners_of(gray: NDArray[np.uint8], where: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the strongest corners by Shi and Tomasi, (n, 2) float32, positions (x, y)."""
    corners, strength = cv2.goodFeaturesToTrackWithQuality(
        gray, _MOST_OF_WORLD, _QUALITY, _WORLD_APART, where
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
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """
    Follow points, (n, 2) float32, (x, y), by the pyramidal method of Lucas and Kanade.

    :param levels: of the pyramids to use, the largest image first.
    :param expected: shift (x, y) in pixels about which they are sought.
    :returns: where points are now, (n, 2) float32, and (n,) bool, whether that is known.
    """
    if len(points) == 0:
        return points, np.zeros(0, np.bool_)
    scale, levels_up = np.float32(0.5**levels.start), len(levels) - 1
    before = scale * points - np.float32(0.5)
    after = before + scale * np.array(expected, np.float32)
    image, both = last.image(levels.start), np.concatenate([before, after])
    # Only the part that is needed; at least one pixel, also if places are NaN.
    margin, size = _COMPARED_PX << levels_up, np.array(image.shape[::-1])
    low, high = (reduced(both).astype(float) for reduced in (np.fmin.reduce, np.fmax.reduce))
    start = np.minimum(np.fmax(low - margin, 0), size - 1).astype(int)
    end = np.minimum(np.fmax(high + margin, start + 1), size).astype(int)
    window, corner = np.s_[start[1] : end[1], start[0] : end[0]], start.astype(np.float32)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        image[window],
        now.image(levels.start)[window],
        before - corner,
        after - corner,
        winSize=(_COMPARED_PX, _COMPARED_PX),
        maxLevel=levels_up,
        criteria=_UNTIL,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray((moved + corner + np.float32(0.5)) / scale), found.ravel() > 0


def camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the homography that most points, (n, 2) float32, agree on; None if few or still.

    That is how a still world looks to a camera that turns, and a plane to any camera.
    """
    if len(before) < _LEAST_POINTS:
        return None
    shift = np.hypot(*(after - before).T)
    if np.partition(shift, len(shift) // 2)[len(shift) // 2] < _STILL_PX:
        return None
    # OpenCV draws the same samples in every call.
    motion, agrees = cv2.findHomography(
        before, after, cv2.USAC_FAST, _REACH_PX, maxIters=_MOST_SAMPLES
    )
    least = max(_LEAST_POINTS, _LEAST_AGREEING * len(before))
    if motion is None or np.count_nonzero(agrees) < least or not _is_plausible(motion, before):
        return None
    return np.asarray(motion)


def _is_plausible(motion: NDArray[np.float64], points: NDArray[np.float32]) -> bool:
    """Tell whether a camera can have moved like this, by the sides of the points' box."""
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
    rim = np.array([[(left, top), (right, top), (right, bottom), (left, bottom)]], np.float64)
    now = cv2.perspectiveTransform(rim, motion)
    before, after = (np.roll(each[0], -1, axis=0) - each[0] for each in (rim, now))
    change = (after @ (1, 1j)) / (before @ (1, 1j))
    zoom, turn = np.abs(change), np.abs(np.angle(change))
    return bool(
        (turn < _MOST_TURN).all() and (zoom > 1 / _MOST_ZOOM).all() and (zoom < _MOST_ZOOM).all()
    )
