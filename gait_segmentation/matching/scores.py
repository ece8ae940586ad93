# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory for the path scores of frames, of those sequences that were searched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.search_range import Place, SearchRange
from gait_segmentation.matching.tanimoto import pitch_of

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

    ``rows`` is (R, n) int16, phase by phase the scores of the lanes of ``searched`` with filling;
    what is left of a row is not used.  ``where`` is (V,) int32, the row of each sequence, -1 for
    those that were not searched: they are at the floor.  So are placements that were not.
    """

    rows: NDArray[np.int16]
    where: NDArray[np.int32]
    searched: SearchRange

    def of(self, sequence: int, phase: int) -> NDArray[np.int16]:
        """Return the scores of a template that was searched, one for each lane, int16."""
        start = phase * pitch_of(self.searched.size)
        return self.rows[self.where[sequence], start : start + self.searched.size]

    def at(self, sequence: int, phase: int, place: Place) -> int:
        """Return the score of a template at a placement."""
        row, lane = self.where[sequence], self.searched.lane(*place)
        if row < 0 or lane is None:
            return FLOOR
        return int(self.rows[row, phase * pitch_of(self.searched.size) + lane])


class ScoreStore:
    """
    Rows of scores that frames take and give back, each row for one sequence.

    The builds a bank has are searched together only in the first frame of a path, so that there
    are far fewer rows than frames times sequences.
    """

    def __init__(self, rows: int, size: int) -> None:
        """
        Make the memory.

        :param rows: how many are expected to be in use; if it is more, the store grows.
        :param size: n, the most scores that a sequence has in a frame.
        """
        self.rows: NDArray[np.int16] = np.empty((rows, size), np.int16)
        """(R, n) int16; another array after :meth:`take` if the store has grown."""
        self._free = list(range(rows))[::-1]

    @property
    def used(self) -> int:
        """Return how many rows are in use."""
        return len(self.rows) - len(self._free)

    def take(self, active: NDArray[np.bool_]) -> NDArray[np.int32]:
        """
        Take rows for a frame; what is in them is undefined.

        :param active: (V,) bool, sequences that are searched.
        :returns: (V,) int32, the row of each sequence, -1 for those that are not searched.
        """
        count = int(active.sum())
        if count > len(self._free):
            self._grow(count)
        where = np.full(len(active), -1, np.int32)
        where[active] = self._free[len(self._free) - count :]
        del self._free[len(self._free) - count :]
        return where

    def give_back(self, where: NDArray[np.int32]) -> None:
        """Give back what :meth:`take` returned."""
        self._free += where[where >= 0].tolist()

    def _grow(self, count: int) -> None:
        """Add rows, so that a number of them can be taken."""
        old = len(self.rows)
        more = max(count - len(self._free), old // 2)
        self.rows = np.concatenate(
            [self.rows, np.empty((more, self.rows.shape[1]), self.rows.dtype)]
        )
        self._free = [*range(old + more - 1, old - 1, -1), *self._free]
