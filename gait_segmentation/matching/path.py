# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The best sequence of templates and placements over a sliding window of frames."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.backtrack import trace
from gait_segmentation.matching.builds import builds_of
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.scores import Scores, ScoreStore
from gait_segmentation.matching.search_range import Place, SearchRange
from gait_segmentation.matching.tanimoto import pitch_of
from gait_segmentation.matching.transitions import UNIT, phase_costs, view_changes
from gait_segmentation.matching.viterbi import advance, shifted

__all__ = ['Path', 'PathSearch']

_MOST_BYTES = 12 * 2**20
"""Memory for the scores of one build, 34 frames of the standard one; those of all are kept of the
first frame only."""
_STEPS_PER_STRIDE = 2
_RATE_SPAN = 0.5
"""Seconds of path from which on its own rate is believed."""


@dataclass(frozen=True)
class Path:
    """
    The best path through the frames of the window, oldest frame first.

    ``states`` is (N, 5) int64: sequence, phase, scale, row, column.  ``seconds`` (N,) float64
    counts from the first frame of the path search.  ``rate`` is in strides per second.
    """

    states: NDArray[np.int64]
    seconds: NDArray[np.float64]
    rate: float


class PathSearch:
    """
    Viterbi search over sequence, phase and placement, exact on whole numbers.

    Scores fade with the time constant ``memory`` and are kept relative to the best one, so that
    they stay bounded however long the search runs.  After Wang, Yagi and Makihara, ACCV 2009,
    section 2 (the sequence of templates that fits best under dynamic time warping); fading,
    views and placement moves are this package's.
    """

    def __init__(
        self,
        bank: TemplateBank,
        row: NDArray[np.int32],
        shape: Place,
        config: MatchingConfig,
    ) -> None:
        """
        Prepare the search.

        :param row: (K,) int32, where among the similarities those of a template are.
        :param shape: the most body heights, vertical and horizontal shifts searched in a frame.
        """
        self._config = config
        self._row = row
        self._near, self._near_cost = view_changes(bank, config)
        self._move_cost = round(UNIT * config.move_cost)
        together = int(np.bincount(builds_of(bank)).max())
        lanes = pitch_of(math.prod(shape))
        slots = max(config.lag + 2, min(64, _MOST_BYTES // (2 * together * bank.phases * lanes)))
        # A range that moves needs as much again as the frame before it.
        rows = bank.sequences + slots * together
        self._store = ScoreStore(rows, bank.phases * lanes)
        self._where = np.full((slots, bank.sequences), -1, np.int32)
        self._costs = np.zeros((slots, bank.phases), np.int16)
        self._counts = np.zeros(slots, np.int64)
        self._shifts = np.zeros((slots, 3), np.int64)
        self._ranges = np.zeros((slots, 7), np.int64)
        self._nothing = np.full(bank.sequences, -1, np.int32)
        self.leading: NDArray[np.int16] = np.zeros((bank.sequences, bank.phases), np.int16)
        self._nominal = (config.minimum_cadence + config.maximum_cadence) / 240
        self._slots: list[int] = []
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        while self._slots:
            self._store.give_back(self._where[self._slots.pop()])
        self._seconds: list[float] = []
        self._best = 0
        self._rate = self._nominal
        self._followed: tuple[int, int] | None = None
        self._leader: tuple[int, int, int, int, int] | None = None
        self._traced = np.empty((0, 5), np.int64)

    @property
    def frames(self) -> int:
        """Return the number of frames in the window."""
        return len(self._slots)

    def scores(self, back: int) -> Scores:
        """Return the scores of a frame until the next step; 0 = the newest, 1 the one before."""
        slot = self._slots[-1 - back]
        return Scores(self._store.rows, self._where[slot], self._range(slot))

    def step(
        self,
        similarity: NDArray[np.int16],
        seconds: float,
        jump: Place,
        searched: SearchRange,
        active: NDArray[np.bool_] | None = None,
    ) -> None:
        """
        Take in a frame.

        :param similarity: (R, N) int16, of the template of each row at each placement searched.
        :param seconds: its time, later than the last frame's.
        :param jump: by how many body heights, vertical and horizontal shifts the box moved
            against the body since the last frame.
        :param searched: the placements searched.
        :param active: (V,) bool, sequences that are searched; all if None.
        """
        config = self._config
        if active is None:
            active = np.ones(len(self.leading), np.bool_)
        started = bool(self._slots)
        passed = seconds - self._seconds[-1] if started else 0.0
        self._make_room(seconds)
        before = self._where[self._slots[-1]] if started else self._nothing
        moved = self._moved(searched, jump) if started else None
        cost = phase_costs(
            len(self._costs[0]),
            passed,
            self._rate,
            config.maximum_cadence / 60 / _STEPS_PER_STRIDE,
            config.rate_cost,
        )
        slot = next(k for k in range(len(self._where)) if k not in self._slots)
        self._where[slot] = self._store.take(active)
        fading = min(int(32768 * math.exp(-passed / config.memory)), 32767)
        advance(
            self._store.rows,
            before if moved is None else moved,
            self._where[slot],
            np.int16(self._best),
            np.int16(fading),
            cost,
            self._near,
            self._near_cost,
            np.int16(self._move_cost),
            searched.shape,
            similarity,
            self._row,
            self.leading,
        )
        if moved is not None:
            self._store.give_back(moved)
        self._slots.append(slot)
        self._seconds.append(seconds)
        self._costs[slot, : len(cost)], self._counts[slot] = cost, len(cost)
        self._shifts[slot] = jump
        self._ranges[slot] = *searched.first, *searched.shape, similarity.shape[1]
        self._best = int(self.leading.max())
        self._leader = None

    def _make_room(self, seconds: float) -> None:
        """Let go of the oldest frames, so that one of a time can be taken in."""
        config = self._config
        while self._slots and (
            len(self._slots) == len(self._where)
            or (len(self._slots) > config.lag + 1 and seconds - self._seconds[1] > config.window)
        ):
            self._store.give_back(self._where[self._slots[0]])
            del self._slots[0], self._seconds[0]
            self._traced = self._traced[1:]

    def _moved(self, searched: SearchRange, jump: Place) -> NDArray[np.int32] | None:
        """
        Return rows with the scores of the frame before at the placements searched now.

        :returns: (V,) int32, None if they were those of the frame before.
        """
        slot = self._slots[-1]
        last = self._range(slot)
        shift = np.add(searched.first, jump) - last.first
        if searched.shape == last.shape and not shift.any():
            return None
        rows = self._store.take(self._where[slot] >= 0)
        lanes = pitch_of(last.size), pitch_of(searched.size)
        sizes = self._costs.shape[1], last.shape, searched.shape, lanes
        shifted(self._store.rows, self._where[slot], rows, *sizes, shift)
        return rows

    def _range(self, slot: int) -> SearchRange:
        """Return what was searched in the frame of a slot."""
        a, b, c, scales, rows, columns, _ = self._ranges[slot].tolist()
        return SearchRange((a, b, c), (scales, rows, columns))

    def leader(self) -> tuple[int, int, int, int, int]:
        """
        Return sequence, phase, scale, row and column of the state to trace back from.

        The path followed so far is left only for one that leads by ``switch_margin``, so that
        equally good half-cycle twins do not alternate.
        """
        if self._leader is None:
            sequence, phase = self._leading_template()
            scores = self.scores(0)
            lane = int(scores.of(sequence, phase).argmax())
            self._leader = sequence, phase, *scores.searched.place(lane)
        return self._leader

    def follow(self) -> Path:
        """Trace the path back from the leader."""
        leader = self.leader()
        states = np.empty((len(self._slots), 5), np.int64)
        states[-1] = leader
        trace(
            self._store.rows,
            self._where,
            np.array(self._slots, np.int64),
            self._costs,
            self._counts,
            self._shifts,
            self._ranges,
            self._near,
            self._near_cost,
            np.int64(self._move_cost),
            self._traced,
            states,
        )
        self._traced = states
        seconds = np.array(self._seconds)
        rate = self._measure(states[:, 1], seconds)
        lowest, highest = self._config.minimum_cadence, self._config.maximum_cadence
        if seconds[-1] - seconds[0] >= _RATE_SPAN:
            self._rate = min(max(rate, lowest / 120), highest / 120)
        self._followed = leader[:2]
        return Path(states, seconds, rate)

    def _leading_template(self) -> tuple[int, int]:
        """Return sequence and phase of the leader."""
        phases = self.leading.shape[1]
        best = divmod(int(self.leading.argmax()), phases)
        if self._followed is None or len(self._slots) < 2:
            return best
        view, phase = self._followed
        expected = phase + phases * self._rate * (self._seconds[-1] - self._seconds[-2])
        away = np.abs((np.arange(phases) - expected + phases / 2) % phases - phases / 2)
        family = [view, *self._near[view][self._near[view] >= 0].tolist()]
        alike = np.full(self.leading.shape, np.iinfo(np.int16).min, np.int16)
        alike[family] = np.where(away < phases / 4, self.leading[family], alike[family])
        kept = divmod(int(alike.argmax()), phases)
        lead = int(self.leading[best]) - int(self.leading[kept])
        return kept if lead < UNIT * self._config.switch_margin else best

    def _measure(self, phase: NDArray[np.int64], seconds: NDArray[np.float64]) -> float:
        """Return the slope of the phase over time in strides per second."""
        if len(phase) < 2:
            return 0.0
        count = self.leading.shape[1]
        strides = np.concatenate([[0], np.cumsum(np.diff(phase) % count)]) / count
        time = seconds - seconds.mean()
        return float(time @ strides / (time @ time))
