# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory for the path scores of frames, of those sequences that were searched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ['FLOOR', 'ScoreStore', 'Scores']

FLOOR = -12000
"""
Worst score relative to the best: nearly six times a similarity of 1.  Twice of it and what any
transition costs below it, also a wall, still fit 16 bits.
"""


@dataclass(frozen=True)
class Scores:
    """
    The scores of a frame.

    ``rows`` is (R, P, N) int16.  ``where`` is (V,) int32, the row of each sequence, -1 for those
    that were not searched: they are at the floor.
    """

    rows: NDArray[np.int16]
    where: NDArray[np.int32]

    def of(self, sequence: int, phase: int) -> NDArray[np.int16]:
        """Return the scores of a template that was searched, (N,) int16."""
        return np.asarray(self.rows[self.where[sequence], phase])

    def at(self, sequence: int, phase: int, lane: int) -> int:
        """Return the score of a template at a placement."""
        row = self.where[sequence]
        return int(self.rows[row, phase, lane]) if row >= 0 else FLOOR


class ScoreStore:
    """
    Rows of scores that frames take and give back, each row for one sequence.

    The builds a bank has are searched together only in the first frame of a path, so that there
    are far fewer rows than frames times sequences.
    """

    def __init__(self, rows: int, phases: int, heights: int, lanes: int) -> None:
        """
        Make the memory.

        :param rows: how many are expected to be in use; if it is more, the store grows.
        :param heights: body heights of a row, each with ``lanes`` placements.
        """
        self.rows: NDArray[np.int16] = np.empty((rows, phases, heights * lanes), np.int16)
        """(R, P, N) int16; another array after :meth:`take` if the store has grown."""
        self._heights = heights
        self._at_floor = np.zeros((rows, heights), np.bool_)
        self._free = list(range(rows))[::-1]

    @property
    def used(self) -> int:
        """Return how many rows are in use."""
        return len(self.rows) - len(self._free)

    def take(self, active: NDArray[np.bool_], searched: slice) -> NDArray[np.int32]:
        """
        Take rows for a frame.

        :param active: (V,) bool, sequences that are searched.
        :param searched: body heights that are, from ``start`` up to ``stop``: the others are at
            the floor, these undefined.
        :returns: (V,) int32, the row of each sequence, -1 for those that are not searched.
        """
        count = int(active.sum())
        if count > len(self._free):
            self._grow(count)
        taken = self._free[len(self._free) - count :]
        del self._free[len(self._free) - count :]
        left_out = np.ones(self._heights, np.bool_)
        left_out[searched] = False
        rest = left_out & ~self._at_floor[taken]
        if rest.any():
            scores = self.rows.reshape(*self.rows.shape[:2], self._heights, -1)
            for height in np.flatnonzero(left_out):
                scores[np.array(taken)[rest[:, height]], :, height] = FLOOR
        self._at_floor[taken] = left_out
        where = np.full(len(active), -1, np.int32)
        where[active] = taken
        return where

    def give_back(self, where: NDArray[np.int32]) -> None:
        """Give back what :meth:`take` returned."""
        self._free += where[where >= 0].tolist()

    def _grow(self, count: int) -> None:
        """Add rows, so that a number of them can be taken."""
        old = len(self.rows)
        more = max(count - len(self._free), old // 2)
        self.rows = np.concatenate(
            [self.rows, np.empty((more, *self.rows.shape[1:]), self.rows.dtype)]
        )
        self._at_floor = np.concatenate(
            [self._at_floor, np.zeros((more, self._heights), np.bool_)]
        )
        self._free = [*range(old + more - 1, old - 1, -1), *self._free]
