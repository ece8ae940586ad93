# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is to be seen when, from ground truth with several people."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.people import MOST_PEOPLE

__all__ = ['SAME_IOU', 'Attendance', 'Sighting']

SAME_IOU = 0.5
"""Two boxes that overlap at least this much are of the same person."""

SEEN_SHARE = 0.25
"""Share of somebody's greatest visible area nearby in time that counts as seen."""

WHOLE_SHARE = 0.75
"""Share of it that counts as wholly visible, if the box is clear of the border."""

NEARBY_SECONDS = 1.0
"""How far away in time the greatest visible area is looked for."""


@dataclass(frozen=True)
class Sighting:
    """What of a person can be seen in a frame: the tight box and the number of pixels."""

    box: Box
    area: int


class Attendance:
    """
    The people of a clip.

    ``people`` are their labels, ascending; ``numbers`` the frames that have truth.
    """

    def __init__(
        self, frames: Iterable[tuple[int, NDArray[np.uint8]]], fps: float, size: tuple[int, int]
    ) -> None:
        """
        Go through the truth once.

        :param frames: number and labels of the frames that have truth, ascending.
        :param size: width and height of the frames.
        """
        self.fps = fps
        self.size = size
        self.numbers: list[int] = []
        self._sightings: dict[int, dict[int, Sighting]] = {}
        for number, labels in frames:
            self.numbers.append(number)
            counts = np.bincount(labels.ravel(), minlength=MOST_PEOPLE + 1)
            for person in map(int, np.flatnonzero(counts[1 : MOST_PEOPLE + 1]) + 1):
                x, y, width, height = cv2.boundingRect((labels == person).astype(np.uint8))
                seen = Sighting(Box(x, y, width, height), int(counts[person]))
                self._sightings.setdefault(person, {})[number] = seen
        self.people = tuple(sorted(self._sightings))
        self._seen = {
            person: [n for n in seen if self._share(person, n) >= SEEN_SHARE]
            for person, seen in self._sightings.items()
        }

    def sighting(self, person: int, number: int) -> Sighting | None:
        """Return what can be seen of a person in a frame, None if nothing."""
        return self._sightings.get(person, {}).get(number)

    def sightings(self, number: int) -> dict[int, Sighting]:
        """Return what can be seen of everybody in a frame."""
        found = {person: self.sighting(person, number) for person in self.people}
        return {person: seen for person, seen in found.items() if seen is not None}

    def seen(self, person: int) -> list[int]:
        """
        Return the frames in which somebody is not all but hidden, ascending.

        These show at least a quarter of the greatest area seen within a second.
        """
        return self._seen[person]

    def first_whole(self, person: int) -> int | None:
        """
        Return the first frame that shows all of a person, or, if none does, any of them.

        That is one with at least three quarters of the greatest area seen within a second, and a
        box that does not touch the border.
        """
        width, height = self.size
        seen = self._seen[person]
        for number in seen:
            box = self._sightings[person][number].box
            clear = box.x > 0 and box.y > 0 and box.right < width and box.bottom < height
            if clear and self._share(person, number) >= WHOLE_SHARE:
                return number
        return seen[0] if seen else None

    def returns(self, person: int) -> list[int]:
        """Return the frames in which somebody is seen again after not having been seen."""
        seen = set(self._seen[person])
        known = [number for number in self.numbers if number >= min(seen, default=0)]
        return [b for a, b in itertools.pairwise(known) if a not in seen and b in seen]

    def person_at(self, box: Box, number: int) -> int | None:
        """Return whom a box is about in a frame, None if it is nobody's."""
        overlaps = {p: seen.box.iou(box) for p, seen in self.sightings(number).items()}
        person = max(overlaps, key=lambda p: overlaps[p], default=None)
        return person if person is not None and overlaps[person] >= SAME_IOU else None

    def _share(self, person: int, number: int) -> float:
        seen = self._sightings[person]
        reach = round(NEARBY_SECONDS * self.fps)
        near = (seen.get(other) for other in range(number - reach, number + reach + 1))
        most = max(sighting.area for sighting in near if sighting is not None)
        return seen[number].area / most
