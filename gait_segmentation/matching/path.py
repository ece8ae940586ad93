# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The best sequence of templates and placements over a sliding window of frames."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.common_areas import pitch_of
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.placements import SearchRange
from gait_segmentation.matching.views import Views, turned
from gait_segmentation.matching.viterbi import FLOOR, advance, shifted, step_back

UNIT = 2048
"""Whole numbers that a similarity of 1 is in path scores."""

_RATE_SPAN = 0.5
"""Seconds of path from which on its own rate is believed."""
_MOST_FRAMES = 64
"""Frames of a path, however many a second there are."""

State = tuple[int, int, int, int, int]
"""Sequence, phase, scale, row and column."""


@dataclass(frozen=True)
class Scores:
    """
    The scores of a frame.

    ``rows`` is (V, P * N) int16, of each sequence phase by phase the scores of the N lanes of
    ``searched`` with filling.  Placements that were not searched are at the floor.
    """

    rows: NDArray[np.int16]
    searched: SearchRange

    @classmethod
    def empty(cls, sequences: int, phases: int, searched: SearchRange) -> Scores:
        """Make undefined scores."""
        return cls(np.empty((sequences, phases * pitch_of(searched.size)), np.int16), searched)

    def of(self, sequence: int, phase: int) -> NDArray[np.int16]:
        """Return the scores of a template, one for each lane, int16."""
        start = phase * pitch_of(self.searched.size)
        return self.rows[sequence, start : start + self.searched.size]

    def at(self, sequence: int, phase: int, place: Sequence[int]) -> int:
        """Return the score of a template at a placement."""
        lane = self.searched.lane(*place)
        return FLOOR if lane is None else int(self.of(sequence, phase)[lane])

    def moved(self, searched: SearchRange, phases: int) -> Scores:
        """Return the scores where they are in another range of placements."""
        last = self.searched
        if searched == last:
            return self
        shift = np.subtract(searched.first, last.first)
        after = Scores.empty(len(self.rows), phases, searched)
        lanes = pitch_of(last.size), pitch_of(searched.size)
        shifted(self.rows, after.rows, phases, last.shape, searched.shape, lanes, shift)
        return after

    def offsets(self, state: State, beside: tuple[int, int], phases: int) -> list[float]:
        """
        Return how far beside a state the best place lies, in steps of -0.5 to 0.5.

        Along each axis by itself, it is the vertex of the parabola through three scores.

        :param beside: the sequences beside the state's, clockwise and anticlockwise.
        :returns: for view, phase, scale, row and column.
        """
        sequence, phase, *place = state
        sides = [[(each, phase, place) for each in beside]]
        sides.append([(sequence, (phase + step) % phases, place) for step in (-1, 1)])
        for axis in range(3):
            moved = [[at + step * (k == axis) for k, at in enumerate(place)] for step in (-1, 1)]
            sides.append([(sequence, phase, each) for each in moved])
        found, middle = [], self.at(sequence, phase, place)
        for low, high in ((self.at(*one), self.at(*other)) for one, other in sides):
            bend = 2 * middle - low - high
            # What is at the floor has not been searched.
            flat = min(low, high) <= FLOOR or bend <= 0
            found.append(0.0 if flat else min(max(0.5 * (high - low) / bend, -0.5), 0.5))
        return found


@dataclass(frozen=True)
class _Frame:
    """A frame of the search: its scores, its time, and costs of the step to it."""

    scores: Scores
    seconds: float
    costs: NDArray[np.int16]


class PathSearch:
    """
    Viterbi search over sequence, phase and placement, exact on whole numbers.

    A *sequence* of the bank is one build seen from one direction; kernels call it a view.

    Scores fade with the time constant ``memory`` and are kept relative to the best one, so that
    they stay bounded however long the search runs.  After Wang, Yagi and Makihara, ACCV 2009,
    section 2 (the sequence of templates that fits best under dynamic time warping); fading,
    views and placement moves are this package's.
    """

    def __init__(self, bank: TemplateBank, row: NDArray[np.int32], config: MatchingConfig) -> None:
        """
        Prepare the search.

        :param row: (K,) int32, where among the similarities those of a template are.
        """
        self._config = config
        self._row = row
        self._near, self._near_cost = view_changes(bank, config)
        self._move_cost = round(UNIT * config.move_cost)
        self._most_frames = max(config.lag + 2, _MOST_FRAMES)
        self.leading: NDArray[np.int16] = np.zeros((bank.sequences, bank.phases), np.int16)
        """(V, P) int16, the best score of each template in the newest frame."""

        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._frames: list[_Frame] = []
        self._best, self._owed = 0, 0.0
        self.rate = self._config.middle_rate
        """Strides per second with which the path is expected to go on."""

        self._followed: tuple[int, int] | None = None
        self.leader: State = (0, 0, 0, 0, 0)
        """The state of the newest frame to trace back from."""

        self._traced = np.empty((0, 5), np.int64)

    @property
    def frames(self) -> int:
        """Return the number of frames in the window."""
        return len(self._frames)

    def scores(self, back: int) -> Scores:
        """Return the scores of a frame; 0 = the newest, 1 the one before."""
        return self._frames[-1 - back].scores

    def step(
        self,
        similarity: NDArray[np.int16],
        seconds: float,
        searched: SearchRange,
    ) -> None:
        """
        Take in a frame.

        :param similarity: (R, N) int16, of the template of each row at each placement searched.
        :param seconds: its time, later than the last frame's.
        :param searched: the placements searched.
        """
        config, (views, phases) = self._config, self.leading.shape
        after = Scores.empty(views, phases, searched)
        before, passed = Scores.empty(0, phases, searched), 0.0
        if self._frames:
            before = self.scores(0).moved(searched, phases)
            passed = seconds - self._frames[-1].seconds
        # What rounding leaves is owed to the next step, or all would go too slow or too fast.
        owed = self._owed + phases * self.rate * passed
        expected = round(owed)
        self._owed = owed - expected
        costs = phase_costs(phases, passed, expected, config.fastest_rate, config.rate_cost)
        fading = min(int(32768 * math.exp(-passed / config.memory)), 32767)
        advance(
            before.rows,
            after.rows,
            np.int16(self._best),
            np.int16(fading),
            costs,
            self._near,
            self._near_cost,
            np.int16(self._move_cost),
            searched.shape,
            similarity,
            self._row,
            self.leading,
        )
        frames = self._frames
        while frames and (
            len(frames) == self._most_frames
            or (len(frames) > config.lag + 1 and seconds - frames[1].seconds > config.window)
        ):
            del frames[0]
            self._traced = self._traced[1:]
        frames.append(_Frame(after, seconds, costs))
        self._best = int(self.leading.max())
        sequence, phase = self._leading_template()
        lane = int(after.of(sequence, phase).argmax())
        self.leader = sequence, phase, *searched.place(lane)

    def follow(self) -> NDArray[np.int64]:
        """
        Trace the path back from the leader.

        :returns: (N, 5), sequence, phase, scale, row and column of the frames, the oldest first.
        """
        self._traced = states = self._trace(self.leader)
        seconds = np.array([frame.seconds for frame in self._frames])
        if seconds[-1] - seconds[0] >= _RATE_SPAN:
            rate = self._measure(states[:, 1], seconds)
            self.rate = min(max(rate, self._config.slowest_rate), self._config.fastest_rate)
        self._followed = self.leader[:2]
        return states

    def _trace(self, leader: State) -> NDArray[np.int64]:
        """Return the best path to a state of the newest frame, (N, 5), oldest frame first."""
        states = np.empty((len(self._frames), 5), np.int64)
        states[-1] = leader
        for index in range(len(states) - 1, 0, -1):
            if index < len(self._traced) and (states[index] == self._traced[index]).all():
                # Where it meets the path traced before, they are the same.
                states[:index] = self._traced[:index]
                break
            frame, scores = self._frames[index], self._frames[index - 1].scores
            step_back(
                scores.rows,
                frame.costs,
                scores.searched.first,
                scores.searched.shape,
                pitch_of(scores.searched.size),
                self.leading.shape[1],
                self._near,
                self._near_cost,
                self._move_cost,
                states[index],
                states[index - 1],
            )
        return states

    def _leading_template(self) -> tuple[int, int]:
        """
        Return sequence and phase of the leader.

        The path followed so far is left only for one that leads by ``switch_margin``, so that
        equally good half-cycle twins do not alternate.
        """
        phases = self.leading.shape[1]
        best = divmod(int(self.leading.argmax()), phases)
        if self._followed is None or len(self._frames) < 2:
            return best
        view, phase = self._followed
        passed = self._frames[-1].seconds - self._frames[-2].seconds
        expected = phase + phases * self.rate * passed
        away = np.abs((np.arange(phases) - expected + phases / 2) % phases - phases / 2)
        family = [view, *self._near[view][self._near[view] >= 0].tolist()]
        alike = np.full(self.leading.shape, np.iinfo(np.int16).min, np.int16)
        alike[family] = np.where(away < phases / 4, self.leading[family], alike[family])
        kept = divmod(int(alike.argmax()), phases)
        lead = int(self.leading[best]) - int(self.leading[kept])
        return kept if lead < UNIT * self._config.switch_margin else best

    def _measure(self, phase: NDArray[np.int64], seconds: NDArray[np.float64]) -> float:
        """Return the slope of the phase over time in strides per second."""
        count = self.leading.shape[1]
        strides = np.concatenate([[0], np.cumsum(np.diff(phase) % count)]) / count
        time = seconds - seconds.mean()
        return float(time @ strides / (time @ time))


def phase_costs(
    phases: int, seconds: float, expected: int, maximum_rate: float, cost: float
) -> NDArray[np.int16]:
    """
    Return what it costs to advance by 0, 1, 2, ... phases between two frames.

    Standing still is allowed and going back is not.

    :param phases: phases of a stride.
    :param seconds: time between the frames.
    :param expected: how many are.
    :param maximum_rate: most strides per second that are possible.
    :param cost: similarity that a whole stride off the expectation costs.
    :returns: (D,) int16 in path units, D at most ``phases``.
    """
    most = min(max(math.ceil(phases * maximum_rate * seconds - 1e-9), 1), phases - 1)
    off = (abs(steps - min(expected, most)) / phases for steps in range(most + 1))
    return np.array([min(round(UNIT * cost * each), UNIT) for each in off], np.int16)


def view_changes(
    bank: TemplateBank, config: MatchingConfig
) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
    """
    Return from which sequences each sequence can be reached in one frame.

    These are the neighbouring views of the same build, and the same view of other builds.

    :returns: (V, M) int32 sequences, -1 where there are fewer, and (V, M) int16 costs.
    """
    views = Views(bank)
    found = []
    for sequence, (azimuth, build) in enumerate(zip(bank.azimuth, bank.builds, strict=True)):
        reached = dict.fromkeys(views.beside(sequence), config.view_cost)
        for other, (direction, name) in enumerate(zip(bank.azimuth, bank.builds, strict=True)):
            if name != build and abs(turned(float(direction) - float(azimuth))) < 1e-3:
                reached[other] = config.build_cost
        reached.pop(sequence, None)
        found.append(sorted(reached.items()))
    most = max(len(reached) for reached in found)
    sequences = np.full((len(found), most), -1, np.int32)
    costs = np.zeros((len(found), most), np.int16)
    for index, pairs in enumerate(found):
        for place, (other, cost) in enumerate(pairs):
            sequences[index, place] = other
            costs[index, place] = min(round(UNIT * cost), UNIT)
    return sequences, costs
