# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The best sequence of templates and placements over a sliding window of frames."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.builds import builds_of
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.scores import Scores
from gait_segmentation.matching.search_range import Place, SearchRange
from gait_segmentation.matching.transitions import UNIT, phase_costs, view_changes
from gait_segmentation.matching.trellis import Trellis
from gait_segmentation.matching.viterbi import advance

__all__ = ['Path', 'PathSearch']

_RATE_SPAN = 0.5
"""Seconds of path from which on its own rate is believed."""


@dataclass(frozen=True)
class Path:
    """
    The best path through the frames of the window, oldest frame first.

    A *sequence* of the bank is one build seen from one direction; kernels call it a view.

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
        self._trellis = Trellis(bank.sequences, bank.phases, together, shape, config.lag + 2)
        self.leading: NDArray[np.int16] = np.zeros((bank.sequences, bank.phases), np.int16)
        """(V, P) int16, the best score of each template in the newest frame."""

        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._trellis.clear()
        self._best = 0
        self._rate = self._config.middle_rate
        self._followed: tuple[int, int] | None = None
        self._leader: tuple[int, int, int, int, int] | None = None
        self._traced = np.empty((0, 5), np.int64)

    @property
    def frames(self) -> int:
        """Return the number of frames in the window."""
        return len(self._trellis)

    def scores(self, back: int) -> Scores:
        """Return the scores of a frame until the next step; 0 = the newest, 1 the one before."""
        return self._trellis.scores(back)

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
        config, trellis = self._config, self._trellis
        phases = self.leading.shape[1]
        if active is None:
            active = np.ones(len(self.leading), np.bool_)
        started = len(trellis) > 0
        passed = seconds - trellis.seconds[-1] if started else 0.0
        self._make_room(seconds)
        before = trellis.where()
        moved = trellis.moved(searched, jump) if started else None
        costs = phase_costs(phases, passed, self._rate, config.fastest_rate, config.rate_cost)
        after = trellis.add(active, seconds, costs, jump, searched)
        fading = min(int(32768 * math.exp(-passed / config.memory)), 32767)
        advance(
            trellis.rows,
            before if moved is None else moved,
            after,
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
        if moved is not None:
            trellis.give_back(moved)
        self._best = int(self.leading.max())
        self._leader = None

    def _make_room(self, seconds: float) -> None:
        """Let go of the oldest frames, so that one of a time can be taken in."""
        config, trellis = self._config, self._trellis
        while len(trellis) and (
            len(trellis) == trellis.capacity
            or (len(trellis) > config.lag + 1 and seconds - trellis.seconds[1] > config.window)
        ):
            trellis.drop_oldest()
            self._traced = self._traced[1:]

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
        states = self._trellis.trace(
            leader, self._near, self._near_cost, self._move_cost, self._traced
        )
        self._traced = states
        seconds = np.array(self._trellis.seconds)
        rate = self._measure(states[:, 1], seconds)
        if seconds[-1] - seconds[0] >= _RATE_SPAN:
            self._rate = min(max(rate, self._config.slowest_rate), self._config.fastest_rate)
        self._followed = leader[:2]
        return Path(states, seconds, rate)

    def _leading_template(self) -> tuple[int, int]:
        """Return sequence and phase of the leader."""
        phases = self.leading.shape[1]
        best = divmod(int(self.leading.argmax()), phases)
        if self._followed is None or len(self._trellis) < 2:
            return best
        view, phase = self._followed
        then, now = self._trellis.seconds[-2:]
        expected = phase + phases * self._rate * (now - then)
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
