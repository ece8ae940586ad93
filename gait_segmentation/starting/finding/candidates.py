# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Moving blobs followed from frame to frame: who might be a walker."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.starting.finding.blobs import Blob

__all__ = ['Candidate', 'follow']

_MOST = 24
"""Candidates followed at a time."""

_LOST_S = 0.3
"""Time for which a candidate may go unseen."""

_GAIN_PLACE, _GAIN = 0.6, 0.3
"""Share of a sighting in the place, and in speed and size."""

_LEAST_OVERLAP = 0.25
_MOST_ASPECT = 1.3
"""Largest width over height of a new candidate."""

_STEADY_S = 0.1, 0.4
"""Least and longest time after which a shape is compared with an earlier one."""

_LEAST_MOVING = 0.05
"""Share of a blob that must move now for it to be followed."""


@dataclass
class Candidate:
    """
    A blob that is followed.

    ``box`` is its smoothed box in the newest frame, ``speed`` that of its centre against the
    world in pixels a second.  ``blob`` is the number of the blob last seen of it.  ``shapes``
    holds (seconds, normalised shape) of the last frames, ``evidence`` the sum of the log-odds that
    it walks, in seconds, as of ``judged``.
    """

    number: int
    box: Box
    seen: float
    speed: tuple[float, float] = (0.0, 0.0)
    sightings: int = 1
    blob: int = 0
    shapes: deque[tuple[float, NDArray[np.uint8]]] = field(default_factory=deque)
    evidence: float = 0.0
    judged: float = 0.0

    def predicted(self, seconds: float) -> Box:
        """Return where it should be at a time."""
        passed = seconds - self.seen
        return self.box.shifted(self.speed[0] * passed, self.speed[1] * passed)

    def see(self, box: Box, seconds: float) -> None:
        """Take in a sighting."""
        passed = seconds - self.seen
        expected = self.predicted(seconds)
        off = box.center_x - expected.center_x, box.center_y - expected.center_y
        gain = max(_GAIN_PLACE, 1 / (self.sightings + 1))
        rate = max(_GAIN, 1 / (self.sightings + 1))
        x = expected.center_x + gain * off[0]
        y = expected.center_y + gain * off[1]
        self.speed = (
            self.speed[0] + rate * off[0] / passed,
            self.speed[1] + rate * off[1] / passed,
        )
        width = self.box.width + rate * (box.width - self.box.width)
        height = self.box.height + rate * (box.height - self.box.height)
        self.box = Box.from_center(x, y, width, height)
        self.seen = seconds
        self.sightings += 1

    def show(self, shape: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
        """Take in the normalised shape of a sighting; return an earlier one if there is one."""
        self.shapes.append((self.seen, shape))
        while self.seen - self.shapes[0][0] > _STEADY_S[1]:
            self.shapes.popleft()
        first, earlier = self.shapes[0]
        return earlier if self.seen - first >= _STEADY_S[0] else None


def follow(
    candidates: list[Candidate],
    blobs: Sequence[Blob],
    seconds: float,
    least_height: float,
    first_number: int,
) -> list[Candidate]:
    """
    Give the blobs of a frame to the candidates, begin new ones and drop lost ones.

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
        candidates[index].see(blobs[number].box, seconds)
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
        fresh = Candidate(first_number, box, seconds, blob=blob.number)
        first_number += 1
        kept.append(fresh)
    return kept
