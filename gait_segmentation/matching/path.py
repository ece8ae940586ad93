# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The best sequence of templates and placements over a sliding window of frames."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.transitions import UNIT, phase_costs, view_changes
from gait_segmentation.matching.viterbi import advance, shifted, trace

__all__ = ['Areas', 'Path', 'PathSearch']

_MOST_BYTES = 48 * 2**20
_STEPS_PER_STRIDE = 2
_RATE_SPAN = 0.5
"""Seconds of path from which on its own rate is believed."""


@dataclass(frozen=True)
class Areas:
    """
    What the kernels found for a frame.

    ``common`` is C, (S, R, L) int32, ``window`` F, (S * L,) int32, and ``visible`` G over the
    known pixels, like C, or with no scales where everything is known.
    """

    common: NDArray[np.int32]
    window: NDArray[np.int32]
    visible: NDArray[np.int32]


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
        template_area: NDArray[np.int32],
        row: NDArray[np.int32],
        shape: tuple[int, int, int],
        scale_cost: NDArray[np.float64],
        lanes: int,
        config: MatchingConfig,
    ) -> None:
        """
        Prepare the search.

        :param template_area: (K,) int32, G.
        :param row: (K,) int32, where the kernel puts a template's areas.
        :param shape: number of body heights, vertical and horizontal shifts.
        :param scale_cost: (S,) similarity that a body height costs in every frame.
        :param lanes: L, windows of one body height with filling.
        """
        self._config = config
        self._template_area = template_area
        self._row = row
        self._shape = shape
        self._near, self._near_cost = view_changes(bank, config)
        self._move_cost = round(UNIT * config.move_cost)
        self._placement_cost = np.repeat(np.round(UNIT * scale_cost), lanes).astype(np.int16)
        states = (bank.sequences, bank.phases, shape[0] * lanes)
        size = 2 * math.prod(states)
        slots = max(config.lag + 2, min(64, _MOST_BYTES // size))
        self._was_active = np.ones(bank.sequences, np.bool_)
        self._ring = np.empty((slots, *states), np.int16)
        self._nothing = np.empty((0, *states[1:]), np.int16)
        self._scratch = np.empty(states, np.int16)
        self.leading: NDArray[np.int16] = np.zeros(states[:2], np.int16)
        self._most = bank.phases
        self._nominal = (config.minimum_cadence + config.maximum_cadence) / 240
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._slots: list[int] = []
        self._seconds: list[float] = []
        self._costs: list[NDArray[np.int16]] = []
        self._shifts: list[tuple[int, int, int]] = []
        self._best = 0
        self._rate = self._nominal
        self._followed: tuple[int, int] | None = None

    @property
    def frames(self) -> int:
        """Return the number of frames in the window."""
        return len(self._slots)

    def scores(self, back: int) -> NDArray[np.int16]:
        """Return the scores of a frame, (V, P, N) int16; 0 = the newest, 1 the one before."""
        return np.asarray(self._ring[self._slots[-1 - back]])

    def step(
        self,
        areas: Areas,
        seconds: float,
        jump: tuple[int, int, int],
        active: NDArray[np.bool_] | None = None,
    ) -> None:
        """
        Take in a frame.

        :param areas: what the kernels found.
        :param seconds: its time, later than the last frame's.
        :param jump: by how many body heights, vertical and horizontal shifts the box moved
            against the body since the last frame.
        :param active: (V,) bool, sequences that are searched; all if None.
        """
        config = self._config
        if active is None:
            active = np.ones(len(self.leading), np.bool_)
        started = bool(self._slots)
        passed = seconds - self._seconds[-1] if started else 0.0
        while self._slots and (
            len(self._slots) == len(self._ring)
            or (len(self._slots) > config.lag + 1 and seconds - self._seconds[1] > config.window)
        ):
            for items in (self._slots, self._seconds, self._costs, self._shifts):
                del items[0]
        before = self._ring[self._slots[-1]] if started else self._nothing
        if any(jump) and started:
            shifted(before, self._shape, np.array(jump, np.int64), self._scratch)
            before = self._scratch
        cost = phase_costs(
            self._most,
            passed,
            self._rate,
            config.maximum_cadence / 60 / _STEPS_PER_STRIDE,
            config.rate_cost,
        )
        slot = min(set(range(len(self._ring))) - set(self._slots))
        advance(
            before,
            np.int32(self._best),
            np.int32(32768 * math.exp(-passed / config.memory)),
            cost,
            self._near,
            self._near_cost,
            active,
            self._was_active,
            np.int16(self._move_cost),
            self._shape,
            areas.common,
            self._row,
            areas.window,
            self._template_area,
            areas.visible,
            config.minimum_visible,
            self._placement_cost,
            self._ring[slot],
            self.leading,
        )
        self._was_active = active
        self._slots.append(slot)
        self._seconds.append(seconds)
        self._costs.append(cost)
        self._shifts.append(jump)
        self._best = int(self.leading.max())

    def leader(self) -> tuple[int, int, int, int, int]:
        """
        Return sequence, phase, scale, row and column of the state to trace back from.

        The path followed so far is left only for one that leads by ``switch_margin``, so that
        equally good half-cycle twins do not alternate.
        """
        sequence, phase = self._leading_template()
        lanes = self._ring.shape[-1] // self._shape[0]
        scores = self.scores(0)[sequence, phase]
        scale, lane = divmod(int(scores.argmax()), lanes)
        row, column = divmod(lane, self._shape[2])
        return sequence, phase, scale, row, column

    def follow(self) -> Path:
        """Trace the path back from the leader."""
        leader = self.leader()
        count = len(self._slots)
        states = np.empty((count, 5), np.int64)
        states[-1] = leader
        most = max(len(cost) for cost in self._costs)
        costs = np.zeros((count, most), np.int16)
        for index, cost in enumerate(self._costs):
            costs[index, : len(cost)] = cost
        trace(
            self._ring,
            np.array(self._slots, np.int64),
            costs,
            np.array([len(cost) for cost in self._costs], np.int64),
            np.array(self._shifts, np.int64),
            self._near,
            self._near_cost,
            np.int64(self._move_cost),
            self._shape,
            states,
        )
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
