# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where between the states of the search the best one lies."""

from __future__ import annotations

from gait_segmentation.matching.scores import FLOOR, Scores
from gait_segmentation.matching.views import Views

__all__ = ['State', 'SubgridPeak']

State = tuple[int, int, int, int, int]
"""Sequence, phase, scale, row and column."""


class SubgridPeak:
    """
    Refines states by the scores of their neighbours.

    Along each axis by itself, the best place is the vertex of the parabola through the scores of
    a state and its two neighbours.
    """

    def __init__(self, views: Views, phases: int) -> None:
        """Take what lies beside each view; ``phases`` are those of a stride."""
        self._views, self._phases = views, phases

    def offsets(self, scores: Scores, state: State) -> list[float]:
        """
        Return how far the best place lies beside a state, in steps of -0.5 to 0.5.

        :param scores: those of the state's frame.
        :returns: for view, phase, scale, row and column.
        """
        return [self.offset(scores, state, axis) for axis in range(len(state))]

    def offset(self, scores: Scores, state: State, axis: int) -> float:
        """Return the same for one axis, 0 = the view, and so on."""
        sides = state[axis] - 1, state[axis] + 1
        if axis == 0:
            sides = self._views.beside(state[0])
        elif axis == 1:
            sides = sides[0] % self._phases, sides[1] % self._phases
        low, high = (_score(scores, (*state[:axis], side, *state[axis + 1 :])) for side in sides)
        if min(low, high) <= FLOOR:
            # What is beside has not been searched.
            return 0.0
        middle = _score(scores, state)
        bend = 2 * middle - low - high
        vertex = 0.5 * (high - low) / bend if bend > 0 else 0.0
        return min(max(vertex, -0.5), 0.5)


def _score(scores: Scores, state: tuple[int, ...]) -> int:
    sequence, phase, scale, row, column = state
    return scores.at(sequence, phase, (scale, row, column))
