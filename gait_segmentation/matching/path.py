# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The best sequence of templates and placements over a sliding window of frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.common_areas import UNIT
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.placements import SearchRange
from gait_segmentation.matching.viterbi import FLOOR, advance, shifted, step_back

_RATE_SPAN = 0.5  # seconds of path from which on its own rate is trusted
WIDEST = math.radians(46.0)
"""Views farther apart are no neighbours, and have nothing between them."""
_MOST_FRAMES = 64  # frames of a path, however many a second there are

State = tuple[int, int, int, int, int]
"""Sequence, phase, scale, row and column."""

# Steps to the states before and after a state, by axis.
_SIDES = np.stack([-np.eye(5, dtype=np.int64), np.eye(5, dtype=np.int64)])


class Views:
    """The sequences of each build in the order of their azimuths: a ring, anticlockwise."""

    def __init__(self, bank: TemplateBank) -> None:
        self.azimuths = bank.azimuth.astype(np.float64)
        self.rings: dict[str, NDArray[np.int64]] = {}
        for build in dict.fromkeys(bank.builds):
            views = np.array([k for k, name in enumerate(bank.builds) if name == build])
            self.rings[build] = views[np.argsort(self.azimuths[views], kind='stable')]
        self.beside: dict[int, tuple[int, int]] = {}
        """The neighbouring views of the same build, clockwise and anticlockwise."""

        for ring in self.rings.values():
            sides = zip(np.roll(ring, 1).tolist(), np.roll(ring, -1).tolist(), strict=True)
            self.beside.update(zip(ring.tolist(), sides, strict=True))

    def azimuth(self, sequence: int, offset: float) -> float:
        """Return the azimuth ``offset`` views beside a sequence, in radians in [-pi, pi]."""
        own = float(self.azimuths[sequence])
        other = float(self.azimuths[self.beside[sequence][offset > 0]])
        gap = abs(math.remainder(other - own, 2 * math.pi))
        return math.remainder(own if gap > WIDEST else own + offset * gap, 2 * math.pi)


@dataclass(frozen=True)
class Scores:
    """
    The scores of a frame.

    ``rows`` is (V, P * N) int16, of each sequence phase by phase the scores of the N lanes of
    ``searched`` with filling.  Placements that were not searched are at the floor.
    """

    rows: NDArray[np.int16]
    searched: SearchRange

    @cached_property
    def places(self) -> NDArray[np.int16]:
        """Return the same scores without filling, (V, P, scales, rows, columns)."""
        searched, views = self.searched, len(self.rows)
        scores = self.rows.reshape(views, -1, searched.pitch)[..., : searched.size]
        return scores.reshape(*scores.shape[:2], *searched.shape)

    def moved(self, searched: SearchRange, phases: int) -> Scores:
        """Return the scores where they are in another range of placements."""
        last = self.searched
        after = np.empty((len(self.rows), phases * searched.pitch), np.int16)
        lanes, shift = (last.pitch, searched.pitch), np.subtract(searched.first, last.first)
        shifted(self.rows, after, phases, last.shape, searched.shape, lanes, shift)
        return Scores(after, searched)

    def offsets(self, state: State, beside: tuple[int, int]) -> list[float]:
        """
        Return how far beside a state the best place lies, in steps of -0.5 to 0.5.

        Along each axis by itself, it is the vertex of the parabola through three scores.

        :param beside: the sequences beside the state's, clockwise and anticlockwise.
        :returns: for view, phase, scale, row and column.
        """
        here = np.array(state) - (0, 0, *self.searched.first)
        sides = here + _SIDES
        sides[:, 0, 0] = beside
        sides[:, 1, 1] %= self.places.shape[1]
        inside = np.all((sides >= 0) & (sides < self.places.shape), axis=2, keepdims=True)
        scores = self.places[tuple(np.where(inside, sides, here).transpose(2, 0, 1))]
        low, high = np.where(inside[..., 0], scores.astype(np.int64), FLOOR)
        bend = 2 * int(self.places[tuple(here)]) - low - high
        # What is at the floor has not been searched.
        curved = (np.minimum(low, high) > FLOOR) & (bend > 0)
        vertex = 0.5 * (high - low) / np.maximum(bend, 1)
        return np.where(curved, vertex, 0.0).clip(-0.5, 0.5).tolist()


@dataclass(frozen=True)
class PathFrame:
    """
    A frame of the search: its scores, its time, and (D,) int16 costs of the step to it.

    These are in path units, of advancing by 0, 1, ... D - 1 phases; D is at most P.
    """

    scores: Scores
    seconds: float
    costs: NDArray[np.int16]


class PathSearch:
    """
    Viterbi search over sequence, phase and placement, exact on whole numbers.

    A *sequence* of the bank is one build seen from one direction; kernels call it a view.

    Scores fade with the time constant ``memory`` and are kept relative to the best one, so that
    they stay bounded however long the search runs.  After Wang, Yagi and Makihara, ACCV 2009,
    section 3 (the sequence of templates that fits best under dynamic time warping); fading,
    views and placement moves are this package's.
    """

    def __init__(self, bank: TemplateBank, row: NDArray[np.int32], config: MatchingConfig) -> None:
        """Begin a path; ``row`` (K,) int32 is where the similarities of a template are."""
        self._config = config
        self._row = row
        self._near, self._near_cost = view_changes(bank, config)
        self._move_cost = round(UNIT * config.move_cost)
        self._slowest, self._fastest = config.slowest_rate, config.fastest_rate
        self._most_frames = max(config.lag + 2, _MOST_FRAMES)
        self.leading: NDArray[np.int16] = np.zeros((bank.sequences, bank.phases), np.int16)
        """(V, P) int16, the best score of each template in the newest frame."""

        self.frames: list[PathFrame] = []
        """Those in the window, the oldest first."""

        self._best, self._owed = 0, 0.0
        self.rate = self._config.middle_rate
        """Strides per second with which the path is expected to go on."""

        self._followed: tuple[int, int] | None = None
        self.leader: State = (0, 0, 0, 0, 0)
        """The state of the newest frame to trace back from."""

        self._traced = np.empty((0, 5), np.int64)

    def step(self, similarity: NDArray[np.int16], seconds: float, searched: SearchRange) -> None:
        """
        Take in a frame.

        :param similarity: (R, N) int16, of the template of each row at each placement searched.
        :param seconds: its time, later than the last frame's.
        :param searched: the placements searched.
        """
        config, (views, phases) = self._config, self.leading.shape
        after = Scores(np.empty((views, phases * searched.pitch), np.int16), searched)
        before, passed = Scores(after.rows[:0], searched), 0.0
        if self.frames:
            before = self.frames[-1].scores
            if before.searched != searched:
                before = before.moved(searched, phases)
            passed = seconds - self.frames[-1].seconds
        # What rounding leaves is owed to the next step, or all would go too slow or too fast.
        owed = self._owed + phases * self.rate * passed
        expected = round(owed)
        self._owed = owed - expected
        # Of advancing by 0, 1, 2, ... phases: standing still is allowed, going back is not.
        most = min(max(math.ceil(phases * self._fastest * passed - 1e-9), 1), phases - 1)
        off = (abs(steps - min(expected, most)) / phases for steps in range(most + 1))
        costs = np.array(
            [min(round(UNIT * config.rate_cost * each), UNIT) for each in off], np.int16
        )
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
        frames = self.frames
        while frames and (
            len(frames) == self._most_frames
            or (len(frames) > config.lag + 1 and seconds - frames[1].seconds > config.window)
        ):
            del frames[0]
            self._traced = self._traced[1:]
        frames.append(PathFrame(after, seconds, costs))
        self._best = int(self.leading.max())
        sequence, phase = self._leading_template()
        lane = int(after.places[sequence, phase].argmax())
        self.leader = sequence, phase, *searched.place(lane)

    def follow(self) -> NDArray[np.int64]:
        """Trace the path back from the leader: its states, (N, 5) int64, the oldest first."""
        states = np.empty((len(self.frames), 5), np.int64)
        states[-1] = self.leader
        for index in range(len(states) - 1, 0, -1):
            if index < len(self._traced) and (states[index] == self._traced[index]).all():
                # Where it meets the path traced before, they are the same.
                states[:index] = self._traced[:index]
                break
            frame, scores = self.frames[index], self.frames[index - 1].scores
            step_back(
                scores.rows,
                frame.costs,
                scores.searched.first,
                scores.searched.shape,
                scores.searched.pitch,
                self.leading.shape[1],
                self._near,
                self._near_cost,
                self._move_cost,
                states[index],
                states[index - 1],
            )
        self._traced = states
        seconds = np.array([frame.seconds for frame in self.frames])
        if seconds[-1] - seconds[0] >= _RATE_SPAN:
            # The slope of the phase over time.
            count, time = self.leading.shape[1], seconds - seconds.mean()
            strides = np.concatenate([[0], np.cumsum(np.diff(states[:, 1]) % count)]) / count
            rate = float(time @ strides / (time @ time))
            self.rate = min(max(rate, self._slowest), self._fastest)
        self._followed = self.leader[:2]
        return states

    def _leading_template(self) -> tuple[int, int]:
        """Return sequence and phase of the leader."""
        # The path followed is left only by a margin: equally good twins are not to alternate.
        phases = self.leading.shape[1]
        best = divmod(int(self.leading.argmax()), phases)
        if self._followed is None or len(self.frames) < 2:
            return best
        view, phase = self._followed
        passed = self.frames[-1].seconds - self.frames[-2].seconds
        expected = phase + phases * self.rate * passed
        away = np.abs((np.arange(phases) - expected + phases / 2) % phases - phases / 2)
        family = [view, *self._near[view][self._near[view] >= 0].tolist()]
        alike = np.full(self.leading.shape, np.iinfo(np.int16).min, np.int16)
        alike[family] = np.where(away < phases / 4, self.leading[family], alike[family])
        kept = divmod(int(alike.argmax()), phases)
        lead = int(self.leading[best]) - int(self.leading[kept])
        return kept if lead < UNIT * self._config.switch_margin else best


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
        reached = dict.fromkeys(views.beside[sequence], config.view_cost)
        for other, (direction, name) in enumerate(zip(bank.azimuth, bank.builds, strict=True)):
            away = math.remainder(float(direction) - float(azimuth), 2 * math.pi)
            if name != build and abs(away) < 1e-3:
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
