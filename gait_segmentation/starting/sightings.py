# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People found by a detector: who is seen for certain, or again at the same place."""

from __future__ import annotations

from collections.abc import Sequence

from gait_segmentation.detector.lookout import Sighting
from gait_segmentation.geometry import Box
from gait_segmentation.starting.finder import belongs

SURE, _LIKELY = 0.6, 0.3
"""Scores from which somebody is a person at once, and when they are seen again."""

_AGAIN_NS = 1_000_000_000
"""Time within which somebody must be seen again."""

_SAME_PLACE = 0.3
"""Intersection over union of two boxes at the same place."""


class Sightings:
    """Remembers who was seen and is not tracked, until they are seen again."""

    def __init__(self) -> None:
        self._seen: list[tuple[int, Box]] = []

    @property
    def waiting(self) -> bool:
        """Return whether somebody waits for being seen again."""
        return bool(self._seen)

    def update(
        self, sighting: Sighting, occupied: Sequence[Box], least_height: float
    ) -> list[Box]:
        """
        Take in a look at the whole image.

        :param occupied: boxes of who is tracked, in source pixels.
        :param least_height: of who is found, in source pixels.
        :returns: boxes of people who are not tracked, the tallest first.
        """
        before, self._seen = self._seen, []
        found = []
        for person in sighting.people:
            box = person.box
            if person.score < _LIKELY or box.height < least_height or belongs(box, occupied):
                continue
            again = any(
                sighting.stamp_ns - stamp_ns <= _AGAIN_NS and box.iou(other) >= _SAME_PLACE
                for stamp_ns, other in before
            )
            if again or person.score >= SURE:
                found.append(box)
            else:
                self._seen.append((sighting.stamp_ns, box))
        return sorted(found, key=lambda box: -box.height)
