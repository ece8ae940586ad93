# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Moving blobs followed from frame to frame: who might be a walker."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gait_segmentation.geometry import Box
from gait_segmentation.starting.finding.blobs import Blob

__all__ = ['Candidate', 'follow']

_MOST = 24
"""Candidates followed at a time."""

_LOST_S = 0.3
"""Time for which a candidate may go unseen."""

_GAIN_PLACE, _GAIN_SPEED, _GAIN_SIZE = 0.6, 0.3, 0.3
_LEAST_OVERLAP = 0.25
_MOST_ASPECT = 1.3
"""Largest width over height of a new candidate."""

_LEAST_MOVING = 0.05
"""Share of a blob that must move now for it to be followed."""

_KEPT_S = 2.0

_FIRM_S, _FIRM_SIGHTINGS = 0.2, 4
"""Age and number of sightings from which it is known how broad a candidate is."""

_JUMP, _SPREAD, _TOUCHED_S = 0.16, 1.0, 0.3
"""
Step outwards of a side between two sightings, in body heights, and in body heights a second, by
which something else has come to touch it; and the time after which it is the candidate itself that
is so broad.
"""


@dataclass
class Candidate:
    """
    A blob that is followed on the canvas.

    ``box`` is its smoothed box, ``speed`` that of its centre against the world in pixels a
    second.  ``blob`` is the number of the blob last seen of it.  ``way`` holds (seconds, x, y,
    height) in world coordinates, of the last two seconds, ``free`` is when last nothing else had
    come to touch it.
    """

    number: int
    box: Box
    born: float
    seen: float
    speed: tuple[float, float] = (0.0, 0.0)
    sightings: int = 1
    blob: int = 0
    way: deque[tuple[float, float, float, float]] = field(default_factory=deque)
    free: float = 0.0

    def predicted(self, seconds: float) -> Box:
        """Return where it should be at a time."""
        passed = seconds - self.seen
        return self.box.shifted(self.speed[0] * passed, self.speed[1] * passed)

    def see(
        self, box: Box, seconds: float, origin: tuple[float, float], *, alone: bool = False
    ) -> None:
        """
        Take in a sighting.

        :param origin: where the canvas lies in the world.
        :param alone: leave out what has just come to touch it at a side.
        """
        passed = seconds - self.seen
        expected = self.predicted(seconds)
        if alone:
            box = self._alone(box, expected, seconds)
        else:
            self.free = seconds
        off = box.center_x - expected.center_x, box.center_y - expected.center_y
        gain = max(_GAIN_PLACE, 1 / (self.sightings + 1))
        size = max(_GAIN_SIZE, 1 / (self.sightings + 1))
        x = expected.center_x + gain * off[0]
        y = expected.center_y + gain * off[1]
        rate = max(_GAIN_SPEED, 1 / (self.sightings + 1))
        self.speed = (
            self.speed[0] + rate * off[0] / passed,
            self.speed[1] + rate * off[1] / passed,
        )
        width = self.box.width + size * (box.width - self.box.width)
        height = self.box.height + size * (box.height - self.box.height)
        self.box = Box.from_center(x, y, width, height)
        self.seen = seconds
        self.sightings += 1
        self.note(seconds, origin)

    def _alone(self, box: Box, expected: Box, seconds: float) -> Box:
        """Return the box without what has just come to touch it at a side."""
        left, right = expected.x - box.x, box.right - expected.right
        jump = (_JUMP + _SPREAD * (seconds - self.seen)) * self.box.height
        firm = seconds - self.born >= _FIRM_S and self.sightings >= _FIRM_SIGHTINGS
        if not firm or max(left, right) <= jump:
            self.free = seconds
            return box
        if seconds - self.free > _TOUCHED_S:
            return box
        # Where one side is seen, the other is as far from it as before.
        if left <= jump:
            return Box(box.x, box.y, self.box.width, box.height)
        if right <= jump:
            return Box(box.right - self.box.width, box.y, self.box.width, box.height)
        return Box(expected.x, box.y, self.box.width, box.height)

    def note(self, seconds: float, origin: tuple[float, float]) -> None:
        """Remember where it is in the world."""
        box = self.box
        self.way.append((seconds, box.center_x + origin[0], box.center_y + origin[1], box.height))
        while seconds - self.way[0][0] > _KEPT_S:
            self.way.popleft()

    def distance(self) -> float:
        """Return how far it has come, or has grown or shrunk, in body heights."""
        heights = np.array([entry[3] for entry in self.way])
        x, y = (np.array([entry[k] for entry in self.way]) for k in (1, 2))
        part = max(1, len(x) // 4)
        first, last = slice(None, part), slice(-part, None)
        # Head and feet, because legs that come to light are no way.
        top, bottom = (
            float((y + side * heights)[last].mean() - (y + side * heights)[first].mean())
            for side in (-0.5, 0.5)
        )
        down = min(abs(top), abs(bottom)) if top * bottom > 0 else 0.0
        across = float(x[last].mean() - x[first].mean())
        gone = math.hypot(across, down) / float(heights.mean())
        grown = abs(math.log(float(heights[last].mean() / heights[first].mean())))
        return max(gone, grown)


def follow(
    candidates: list[Candidate],
    blobs: Sequence[Blob],
    seconds: float,
    origin: tuple[float, float],
    least_height: float,
    first_number: int,
    *,
    alone: bool = False,
) -> list[Candidate]:
    """
    Give the blobs of a frame to the candidates, begin new ones and drop lost ones.

    :param alone: leave out of the candidates' boxes what has just come to touch them at a side.
    :returns: the candidates there are now.
    """
    pairs = []
    for index, candidate in enumerate(candidates):
        expected = candidate.predicted(seconds)
        for number, blob in enumerate(blobs):
            overlap = expected.iou(blob.box)
            if overlap >= _LEAST_OVERLAP:
                pairs.append((overlap, index, number))
    taken: set[int] = set()
    served: set[int] = set()
    for _, index, number in sorted(pairs, reverse=True):
        if index in served or number in taken:
            continue
        served.add(index)
        taken.add(number)
        candidates[index].see(blobs[number].box, seconds, origin, alone=alone)
        candidates[index].blob = blobs[number].number
    kept = [each for each in candidates if seconds - each.seen < _LOST_S]
    for number, blob in enumerate(blobs):
        if number in taken or len(kept) >= _MOST:
            continue
        box = blob.box
        if box.height < least_height or box.width > _MOST_ASPECT * box.height:
            continue
        if blob.moving < _LEAST_MOVING * blob.area:
            continue
        fresh = Candidate(first_number, box, seconds, seconds, blob=blob.number)
        fresh.note(seconds, origin)
        first_number += 1
        kept.append(fresh)
    return kept
