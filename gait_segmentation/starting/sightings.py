# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People found by a detector: who is seen for certain, or again, or moves."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.geometry import Box
from gait_segmentation.starting.finder import belongs

SURE, _LIKELY, _DOUBTFUL = 0.6, 0.5, 0.3
"""
Scores from which somebody is a person at once, when they are seen again, and when they have moved
until then: what looks a little like a person, as a coat on a hook, does so for as long as it hangs
there.
"""

_AGAIN_NS = 1_000_000_000
"""Time within which somebody must be seen again."""

_SAME = 0.1
"""Intersection over union of two boxes from which they may be of one person."""

_MOVED = 0.1
"""How far somebody has moved who is no thing, in heights of their box."""


class Sightings:
    """Remembers who was seen and is not tracked, until that is sure."""

    def __init__(self) -> None:
        self._seen: list[tuple[int, Box]] = []

    @property
    def waiting(self) -> bool:
        """Return whether somebody waits for being seen again."""
        return bool(self._seen)

    def update(
        self,
        stamp_ns: int,
        people: Sequence[Detection],
        occupied: Sequence[Box],
        least_height: float,
    ) -> list[Box]:
        """
        Take in a look at the whole image.

        :param people: who was seen in the frame of this stamp.
        :param occupied: boxes of who is tracked, in source pixels.
        :param least_height: of who is found, in source pixels.
        :returns: boxes of people who are not tracked, the tallest first.
        """
        before, self._seen = self._seen, []
        found = []
        for person in people:
            box = person.box
            if person.score < _DOUBTFUL or box.height < least_height or belongs(box, occupied):
                continue
            last = max(before, key=lambda seen: box.iou(seen[1]), default=None)
            if last is not None and (stamp_ns - last[0] > _AGAIN_NS or box.iou(last[1]) < _SAME):
                last = None
            if person.score >= SURE or (
                last is not None and (person.score >= _LIKELY or _has_moved(last[1], box))
            ):
                found.append(box)
            else:
                self._seen.append(last or (stamp_ns, box))
        return sorted(found, key=lambda box: -box.height)


def _has_moved(before: Box, now: Box) -> bool:
    dx, dy = now.center_x - before.center_x, now.center_y - before.center_y
    return math.hypot(dx, dy) >= _MOVED * now.height
