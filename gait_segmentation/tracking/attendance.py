# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What it says of a tracked person that a detector does not see them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.geometry import Box
from gait_segmentation.starting.starter import SURE

_ABSENT = math.log(200)
"""How much less than certain a silence by chance is, in logarithms, when nobody is there."""

_MEMORY = 20
"""Looks that the share of those in which somebody was seen is taken over, at most."""

_SAME_PERSON = 0.3
"""Intersection over union from which a box that the detector saw is theirs."""


class Attendance:
    """
    How reliably a detector sees a person, and so what its silence says.

    Of somebody whom it has missed now and then, as people are who sit, bend or are small, silence
    says little; of somebody whom it saw at every look it says soon that nobody is there.
    """

    def __init__(self) -> None:
        self._seen, self._looks = 1.0, 2.0
        self._silence, self._missed = 0.0, 0

    def renewed(self) -> Attendance:
        """Return how reliably they are seen, as of somebody who has just been found again."""
        other = Attendance()
        other._seen, other._looks = self._seen, self._looks
        return other

    @property
    def silent(self) -> bool:
        """Return whether the last look did not see them."""
        return self._missed > 0

    @property
    def is_doubted(self) -> bool:
        """Return whether they were seen so often, and now are not, that nobody is there."""
        return self._silence >= _ABSENT

    def add(
        self, people: Sequence[Detection], boxes: Sequence[Box], *, lost: bool = False
    ) -> None:
        """
        Take in a look at the whole image.

        :param people: who was seen.
        :param boxes: about all of them and about what can be seen, in source pixels.
        :param lost: whether it is not known where they are; something like a person may be
            anywhere.
        """
        least = SURE if lost else 0.0
        seen = [person.box for person in people if person.score >= least]
        if any(box.iou(other) >= _SAME_PERSON for box in boxes for other in seen):
            # Misses tell how reliably they are seen only if they were there, as is known now.
            self._looks += self._missed + 1
            self._seen += 1
            fade = min(1.0, _MEMORY / self._looks)
            self._seen, self._looks = fade * self._seen, fade * self._looks
            self._silence, self._missed = 0.0, 0
        elif not lost:
            # Who is lost is hidden, or was doubted already.
            self._missed += 1
            self._silence -= math.log(max(1 - self._seen / self._looks, 1e-3))
