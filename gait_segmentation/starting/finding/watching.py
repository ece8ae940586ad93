# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which candidates are watched, a few a frame, and what each is matched to."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.finding.candidates import Candidate
from gait_segmentation.starting.finding.scene import SceneFrame
from gait_segmentation.starting.finding.seat import seat
from gait_segmentation.starting.finding.watch import Watch

__all__ = ['LEAST_SIGHTINGS', 'TALL', 'Watching']

LEAST_SIGHTINGS = 3
"""Sightings from which a candidate is more than noise."""

TALL = 0.5
"""Height of another candidate, as a share, from which it is somebody else and no piece."""

_LEAST_WATCHED, _MOST_WATCHED = 4, 16
"""Candidates that are watched at a time, two for each person who is looked for."""

_SHARED_S = 0.16
"""Time in which each candidate that is watched should be matched once."""

_USUAL_PERIOD_S = 0.04
"""Time between two frames up to which frames are not counted for more than one."""

_SAME = 0.4
"""Share of the smaller of two boxes that is common to boxes of the same person."""

_ANEW_S = 0.3
"""Time after which somebody who is matched in a wrong place is sought anew."""

_FIRST_WAY = 0.3
"""Share of the way asked for that somebody must have come to be matched at all."""

_REST_S = 1.0
"""Time for which somebody found is not looked at again."""


class Watching:
    """Watches candidates in turn, until they are found to walk."""

    def __init__(self, bank: TemplateBank, config: StartingConfig, people: int) -> None:
        """
        Watch nobody yet.

        :param bank: from :func:`~gait_segmentation.starting.finding.watch.light_bank`.
        :param people: how many are looked for at most.
        """
        self._bank, self._config = bank, config
        self._most = min(max(2 * people, _LEAST_WATCHED), _MOST_WATCHED)
        self._watched: dict[int, list[Watch]] = {}
        self._rest: dict[int, float] = {}

    def forget(self) -> None:
        """Watch nobody any more."""
        self._watched = {}

    def shift(self, dx: float, dy: float) -> None:
        """Move with the canvas."""
        for watch in itertools.chain(*self._watched.values()):
            watch.shift(dx, dy)

    def keep(self, candidates: Sequence[Candidate], seconds: float) -> None:
        """Watch none but these, and end the rest of those found long ago."""
        numbers = {each.number for each in candidates}
        self._rest = {number: at for number, at in self._rest.items() if at > seconds}
        self._watched = {
            number: watches for number, watches in self._watched.items() if number in numbers
        }

    def look(
        self,
        frame: SceneFrame,
        candidates: Sequence[Candidate],
        known: Sequence[Box],
        stamp_ns: int,
    ) -> list[Box]:
        """
        Match the candidates that have waited longest: one a frame, in a crowd a few.

        Whoever is nearly found comes first.  The fewer frames come, the more are matched in each.

        :param known: boxes of people who are known already.
        :returns: tight boxes in the small image of those who are found to walk.
        """
        seconds = stamp_ns / 1e9
        waiting: list[tuple[bool, float, int, Candidate, Watch | None]] = []
        for each in candidates:
            if each.number in self._rest or _belongs(each.box, known):
                self._watched.pop(each.number, None)
                continue
            if each.seen != seconds or each.sightings < LEAST_SIGHTINGS:
                continue
            for watch in self._watched.get(each.number, ()):
                if watch.due(seconds):
                    waiting.append((not watch.agreed, watch.last, each.number, each, watch))
            if each.number not in self._watched and len(self._watched) < self._most:
                waiting.append((True, each.born, each.number, each, None))
        found: list[Box] = []
        share = max(frame.period, _USUAL_PERIOD_S) / _SHARED_S
        matches = math.ceil(max(len(self._watched), 1) * share)
        for _, _, number, each, begun in sorted(waiting, key=lambda entry: entry[:3]):
            if number not in self._rest and each.distance() >= _FIRST_WAY * self._config.least_way:
                likelihood = _apart(frame, each, candidates)
                box = self._match(likelihood, each, begun, stamp_ns)
                if box is not None:
                    found.append(frame.box_in_image(box))
                    self._rest[number] = seconds + _REST_S
                    self._watched.pop(number)
                matches -= 1
            if matches == 0:
                break
        return found

    def _match(
        self,
        likelihood: NDArray[np.uint8],
        each: Candidate,
        watch: Watch | None,
        stamp_ns: int,
    ) -> Box | None:
        watches = self._watched.setdefault(each.number, [])
        if watch is None:
            watch = Watch(self._bank, self._config, each)
            watches.append(watch)
        box = watch.update(likelihood, each, stamp_ns)
        if (
            box is None
            and watch.astray
            and watch is watches[-1]
            and each.seen - watch.begun >= _ANEW_S
            and each.distance() >= self._config.least_way
        ):
            anew = Watch(self._bank, self._config, each, seat(likelihood, each.box))
            watches[1:] = [anew]
        return box


def _belongs(box: Box, known: Sequence[Box]) -> bool:
    """Tell whether what is in a box may be of somebody known."""
    return any(_overlap(box, other) > _SAME for other in known)


def _apart(
    frame: SceneFrame, one: Candidate, candidates: Sequence[Candidate]
) -> NDArray[np.uint8]:
    """Return the likelihood without what is of other candidates."""
    others = [
        each.blob
        for each in candidates
        if each.blob != one.blob
        and each.seen == one.seen
        and each.box.height > TALL * one.box.height
    ]
    if not others:
        return frame.likelihood
    return np.asarray(cv2.bitwise_and(frame.likelihood, cv2.bitwise_not(frame.of(others))))


def _overlap(a: Box, b: Box) -> float:
    """Return the share of the smaller box that lies in the other."""
    width = min(a.right, b.right) - max(a.x, b.x)
    height = min(a.bottom, b.bottom) - max(a.y, b.y)
    if width <= 0 or height <= 0:
        return 0.0
    return width * height / min(a.width * a.height, b.width * b.height)
