# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The ground about people's feet, where it moves otherwise than the world far behind them.

A camera that goes along with somebody sees the ground at their feet pass by, while houses behind
them hardly move: no similarity is both.  What the world's motion leaves over of corners beside
the legs is taken to change evenly from row to row, as it does on a plane seen from the side, and
to vanish where the ground ends.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.flow import corners_of, followed
from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.ego_motion.world_motion import Ground
from gait_segmentation.geometry import Box, carry, scaling
from gait_segmentation.images import bounding_box

__all__ = ['GroundFinder', 'ground_of']

_STILL = scaling(1.0)

_ASIDE, _FROM, _TO = 1.05, -0.05, 0.6
"""
Where corners of the ground are sought, in body heights from the middle of the body: to both
sides, and from which row to which.
"""

_ENDS_FROM, _ENDS_TO = -0.3, 0.15
"""Rows between which the ground ends, likewise."""

_CORNERS, _APART, _LEAST_STRENGTH = 32, 6, 5e-5
"""Corners wanted, the least distance between two, and the least strength: roads are plain."""

_LEVELS = range(1, 5)

_SEEK_EVERY, _GOES_ON = 4, 4
"""
Frames between two in which ground is sought that is not known to move, and frames for which it is
taken to go on as before while it is not seen well.
"""

_LEAST = 8
"""Corners needed."""

_REACH_PX = 1.0
"""How far off a corner may be that still counts, though next to nothing."""

_LEAST_AGREEING, _GAIN = 0.5, 0.25
"""Share of the corners that must agree, and by how much that must be more than without."""

_ALIKE_PX = 1.0
"""
Most by which the shift at the feet may change from frame to frame, and the largest where the
ground ends: legs of somebody who passes by move evenly, or for a moment only.
"""

_STEEPEST = 0.25
"""Largest change of the shift from row to row."""

_Line = tuple[float, float, float, float]
"""A shift x in row 0 and its change from row to row, and the same of y."""

_NOTHING = (0.0, 0.0, 0.0, 0.0)


class GroundFinder:
    """Finds the motion of the ground from frame to frame; cheap where there is none."""

    def __init__(self) -> None:
        """Start without any."""
        self.reset()

    def reset(self) -> None:
        """Forget the last frames."""
        self._last: tuple[NDArray[np.float64], int] | None = None
        self._sure = False
        self._unseen = 0
        self._wait = 0

    def take_turn(self) -> bool:
        """Count a frame, and return whether to look for the ground in it."""
        self._wait -= 1
        return self._last is not None or self._wait < 0

    def find(
        self,
        frames: tuple[Pyramid, Pyramid],
        camera: NDArray[np.float64] | None,
        clear: NDArray[np.uint8],
        areas: Sequence[Box],
    ) -> Ground | None:
        """
        Return how the ground about people moves, None if as the world does.

        :param frames: the last frame and this one.
        :param camera: 2 x 3, the world's motion between the two; None if it stands still.
        :param clear: (h, w) uint8 of half the last frame, non-zero away from people.
        :param areas: about the people in the last frame, in pixels of full size.
        """
        self._wait = _SEEK_EVERY
        world = _STILL if camera is None else camera
        lowest = max(areas, key=lambda area: area.bottom)
        points = _corners(frames[0].image(_LEVELS.start), clear, areas)
        at_x, at_y = lowest.center_x, lowest.center_y
        stays_x, stays_y = carry(world, at_x, at_y)
        expected = (stays_x - at_x, stays_y - at_y)
        before, after = followed(*frames, points, _LEVELS, expected)
        tall = lowest.height
        ends = at_y + _ENDS_FROM * tall, at_y + _ENDS_TO * tall
        found = ground_of(before, after, world, ends)
        return self._believed(found, world, np.array([at_x, lowest.bottom, 1.0]))

    def _believed(
        self, found: Ground | None, world: NDArray[np.float64], feet: NDArray[np.float64]
    ) -> Ground | None:
        """
        Return what was found if it is as in the frame before, or for some frames what was so.

        :param world: 2 x 3, its motion.
        :param feet: x, y and 1 of the last frame.
        """
        last = self._last
        if found is not None:
            off = found.motion - world
            alike = last is not None and np.hypot(*((off - last[0]) @ feet)) < _ALIKE_PX
            if alike or not self._sure:
                self._last, self._sure, self._unseen = (off, found.row), alike, 0
                return found if alike else None
        if last is None or not self._sure:
            self._last = None
            return None
        self._unseen += 1
        if self._unseen >= _GOES_ON:
            self._last, self._sure = None, False
        return Ground(world + last[0], last[1])


def _corners(
    half: NDArray[np.uint8], clear: NDArray[np.uint8], areas: Sequence[Box]
) -> NDArray[np.float32]:
    """Return corners beside the legs of people, (n, 2) float32 in pixels of full size."""
    where = np.zeros(half.shape, np.uint8)
    for area in areas:
        tall = area.height
        box = Box(
            area.center_x - _ASIDE * tall,
            area.center_y + _FROM * tall,
            2 * _ASIDE * tall,
            (_TO - _FROM) * tall,
        )
        part = box.scaled(0.5).slices(half.shape[1], half.shape[0])
        where[part] = clear[part]
    left, top, width, height = bounding_box(where)
    part = slice(top, top + height), slice(left, left + width)
    points = corners_of(half[part], where[part], _APART, _CORNERS, _LEAST_STRENGTH)
    return 2 * (points + np.array([left, top], np.float32))


def ground_of(
    before: NDArray[np.float32],
    after: NDArray[np.float32],
    camera: NDArray[np.float64],
    ends: tuple[float, float],
) -> Ground | None:
    """
    Return how the ground moves, None if it moves as everything else does or is not seen well.

    :param before, after: (n, 2) float32, positions (x, y) of corners of the ground.
    :param camera: 2 x 3, the motion of the world.
    :param ends: rows between which the ground ends.
    """
    if len(before) < _LEAST:
        return None
    off = (after - (before @ camera[:, :2].T + camera[:, 2])).astype(np.float64)
    rows = before[:, 1].astype(np.float64)
    x, across, y, along = line = _line(rows, off)
    share, without = _agreeing(rows, off, line), _agreeing(rows, off, _NOTHING)
    if share < max(_LEAST_AGREEING, without + _GAIN):
        return None
    square = across * across + along * along
    end = -(x * across + y * along) / square if square > 0 else ends[0]
    row = min(max(end, ends[0]), ends[1])
    if np.hypot(x + across * row, y + along * row) > _ALIKE_PX:
        return None
    motion = camera + np.array([[0.0, across, x], [0.0, along, y]])
    return Ground(motion, round(row))


def _line(rows: NDArray[np.float64], off: NDArray[np.float64]) -> _Line:
    """Return the line that most of what is left over of corners, (n, 2), lies about."""
    places = np.column_stack([rows, off]).astype(np.float32)
    # OpenCV draws the same samples in every call.
    found = cv2.fitLine(places, cv2.DIST_WELSCH, _REACH_PX, 0.01, 0.01).ravel().tolist()
    along_rows, across, down, row, x, y = found
    if abs(along_rows) * _STEEPEST < max(abs(across), abs(down)):
        return _NOTHING
    across, down = across / along_rows, down / along_rows
    return x - across * row, across, y - down * row, down


def _agreeing(rows: NDArray[np.float64], off: NDArray[np.float64], line: _Line) -> float:
    """Return how well a line explains what is left of the corners, 1 to 0."""
    x, across, y, down = line
    far = (x + across * rows - off[:, 0]) ** 2 + (y + down * rows - off[:, 1]) ** 2
    return float(np.maximum(1 - far / _REACH_PX**2, 0).mean())
