# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which candidates are watched, a few a frame, and what each is matched to."""

from __future__ import annotations

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

_REST_S = 1.0
"""Time for which somebody found is not looked at again."""


class Watching:
    """
    Watches candidates in turn, until they are found to walk.

    ``judged`` are the boxes and measures of those who were matched in the last frame, found or
    not.
    """

    def __init__(self, bank: TemplateBank, config: StartingConfig, people: int) -> None:
        """
        Watch nobody yet.

        :param bank: from :func:`~gait_segmentation.starting.finding.watch.light_bank`.
        :param people: how many are looked for at most.
        """
        self._bank, self._config = bank, config
        self._most = min(max(2 * people, _LEAST_WATCHED), _MOST_WATCHED)
        self._watched: dict[int, Watch] = {}
        self._rest: dict[int, float] = {}
        self.judged: list[tuple[Box, dict[str, float]]] = []

    def forget(self) -> None:
        """Watch nobody any more."""
        self._watched = {}

    def shift(self, dx: float, dy: float) -> None:
        """Move with the world."""
        for watch in self._watched.values():
            watch.shift(dx, dy)

    def keep(self, candidates: Sequence[Candidate], seconds: float) -> None:
        """Watch none but these, and end the rest of those found long ago."""
        numbers = {each.number for each in candidates}
        self._rest = {number: at for number, at in self._rest.items() if at > seconds}
        self._watched = {
            number: watch for number, watch in self._watched.items() if number in numbers
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
        self.judged = []
        waiting: list[tuple[bool, float, Candidate]] = []
        for each in candidates:
            if each.number in self._rest or _belongs(each.box, known):
                self._watched.pop(each.number, None)
                continue
            if each.seen != seconds or each.sightings < LEAST_SIGHTINGS:
                continue
            watch = self._watched.get(each.number)
            if watch is not None and watch.due(seconds):
                waiting.append((watch.evidence == 0, watch.last, each))
            elif watch is None and len(self._watched) < self._most:
                waiting.append((True, each.born, each))
        found: list[Box] = []
        share = max(frame.period, _USUAL_PERIOD_S) / _SHARED_S
        matches = math.ceil(max(len(self._watched), 1) * share)
        waiting.sort(key=lambda entry: (*entry[:2], entry[2].number))
        for _, _, each in waiting[:matches]:
            watch = self._match(_apart(frame, each, candidates), each, stamp_ns)
            if watch.box is None or watch.measures is None:
                continue
            box = watch.box
            self.judged.append((box, watch.measures))
            if watch.walks(each, self._config):
                found.append(box)
                self._rest[each.number] = seconds + _REST_S
                self._watched.pop(each.number)
        return found

    def _match(self, likelihood: NDArray[np.uint8], each: Candidate, stamp_ns: int) -> Watch:
        if each.number not in self._watched:
            self._watched[each.number] = Watch(self._bank, each, likelihood)
        watch = self._watched[each.number]
        watch.update(likelihood, each, stamp_ns)
        return watch


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
