# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of a path search, and the way back through them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.backtrack import trace
from gait_segmentation.matching.scores import Scores, ScoreStore
from gait_segmentation.matching.search_range import Place, SearchRange
from gait_segmentation.matching.tanimoto import pitch_of
from gait_segmentation.matching.viterbi import shifted

__all__ = ['Trellis']

_MOST_BYTES = 12 * 2**20
"""Memory for the scores of one build, 34 frames of the standard one; those of all are kept of the
first frame only."""


class Trellis:
    """
    What a path search keeps of each frame: scores, placements searched, costs of the step to it.

    The frames lie in the rows of a few arrays, in *slots* that are used again and again, so that
    kernels can go through them.  They are counted back from the newest one, which is 0.
    """

    def __init__(
        self, sequences: int, phases: int, together: int, shape: Place, least_frames: int
    ) -> None:
        """
        Make the memory.

        :param sequences: V.
        :param phases: P of each.
        :param together: most sequences that are searched in a frame but the first.
        :param shape: most body heights, vertical and horizontal shifts searched in a frame.
        :param least_frames: how many must find room, however large they are.
        """
        self._phases = phases
        lanes = pitch_of(math.prod(shape))
        fit = _MOST_BYTES // (2 * together * phases * lanes)
        self.capacity = capacity = max(least_frames, min(64, fit))
        """Frames there is room for."""

        # A range that moves needs as much again as the frame before it.
        self._store = ScoreStore(sequences + capacity * together, phases * lanes)
        self._where = np.full((capacity, sequences), -1, np.int32)
        self._costs = np.zeros((capacity, phases), np.int16)
        self._counts = np.zeros(capacity, np.int64)
        self._jumps = np.zeros((capacity, 3), np.int64)
        self._ranges = np.zeros((capacity, 7), np.int64)
        self._nothing = np.full(sequences, -1, np.int32)
        self._slots: list[int] = []
        self.seconds: list[float] = []
        """Times of the frames, oldest first."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._slots)

    @property
    def rows(self) -> NDArray[np.int16]:
        """Return the scores of all frames, (R, n) int16; another array once it has grown."""
        return self._store.rows

    @property
    def used(self) -> int:
        """Return how many of the rows are in use."""
        return self._store.used

    def clear(self) -> None:
        """Forget all frames."""
        while self._slots:
            self._store.give_back(self._where[self._slots.pop()])
        self.seconds = []

    def drop_oldest(self) -> None:
        """Forget the oldest frame."""
        self._store.give_back(self._where[self._slots.pop(0)])
        del self.seconds[0]

    def add(
        self,
        active: NDArray[np.bool_],
        seconds: float,
        costs: NDArray[np.int16],
        jump: Place,
        searched: SearchRange,
    ) -> NDArray[np.int32]:
        """
        Take in a frame, for which there must be room.

        :param active: (V,) bool, sequences that are searched.
        :param seconds: its time.
        :param costs: (D,) int16, of advancing by 0, 1, ... phases since the frame before.
        :param jump: by how many placements the box moved against the body since then.
        :param searched: the placements searched.
        :returns: (V,) int32, the rows for its scores, which are undefined; -1 = not searched.
        """
        slot = next(k for k in range(self.capacity) if k not in self._slots)
        self._where[slot] = self._store.take(active)
        self._costs[slot, : len(costs)], self._counts[slot] = costs, len(costs)
        self._jumps[slot] = jump
        self._ranges[slot] = *searched.first, *searched.shape, pitch_of(searched.size)
        self._slots.append(slot)
        self.seconds.append(seconds)
        return self._where[slot]

    def where(self) -> NDArray[np.int32]:
        """Return the rows of the newest frame, (V,) int32; all -1 if there is no frame."""
        return self._where[self._slots[-1]] if self._slots else self._nothing

    def moved(self, searched: SearchRange, jump: Place) -> NDArray[np.int32] | None:
        """
        Copy the scores of the newest frame to where they are in a new range of placements.

        :param jump: by how many placements the box has moved against the body since.
        :returns: (V,) int32 rows, to be given back; None if the range is the same.
        """
        where, last = self.where(), self.searched(0)
        shift = np.add(searched.first, jump) - last.first
        if searched.shape == last.shape and not shift.any():
            return None
        moved = self._store.take(where >= 0)
        pitches = pitch_of(last.size), pitch_of(searched.size)
        sizes = self._phases, last.shape, searched.shape, pitches
        shifted(self.rows, where, moved, *sizes, shift)
        return moved

    def give_back(self, moved: NDArray[np.int32]) -> None:
        """Let go of the rows that :meth:`moved` returned."""
        self._store.give_back(moved)

    def searched(self, back: int) -> SearchRange:
        """Return the placements searched in a frame."""
        a, b, c, scales, rows, columns, _ = self._ranges[self._slots[-1 - back]].tolist()
        return SearchRange((a, b, c), (scales, rows, columns))

    def scores(self, back: int) -> Scores:
        """Return the scores of a frame until the next one is added."""
        return Scores(self.rows, self._where[self._slots[-1 - back]], self.searched(back))

    def trace(
        self,
        leader: tuple[int, int, int, int, int],
        near: NDArray[np.int32],
        near_cost: NDArray[np.int16],
        move_cost: int,
        known: NDArray[np.int64],
    ) -> NDArray[np.int64]:
        """
        Return the best path to a state of the newest frame, oldest frame first.

        :param leader: the state: sequence, phase, scale, row and column.
        :param near: (V, M) int32 and ``near_cost`` (V, M) int16, see :func:`view_changes`.
        :param move_cost: of moving the placement by one step.
        :param known: (M, 5) int64, a path found before through the first M of the frames.
        :returns: (N, 5) int64.
        """
        states = np.empty((len(self), 5), np.int64)
        states[-1] = leader
        trace(
            self.rows,
            self._where,
            np.array(self._slots, np.int64),
            self._costs,
            self._counts,
            self._jumps,
            self._ranges,
            near,
            near_cost,
            np.int64(move_cost),
            known,
            states,
        )
        return states
