# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
One step of the search over all states, in whole numbers of 16 bits throughout.

All loops over placements run over different, contiguous arrays and do nothing but 16-bit
arithmetic, so that the vector unit treats 16 or 32 placements at a time.
"""

from __future__ import annotations

import numpy as np

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.scores import FLOOR

__all__ = ['advance', 'shifted']

_WALL = -FLOOR
"""Cost of coming from beyond the border: whatever pays it falls to the floor."""
_NOWHERE = 2 * FLOOR
"""Score of body heights there are not: at the floor, also where the best score is negative."""


@kernel(
    'i2[:,::1], i4[::1], i4[::1], i2, i2, i2[::1], i4[:,::1], i2[:,::1], i2, '
    'UniTuple(i8, 3), i2[:,::1], i4[::1], i2[:,::1]'
)
def advance(  # type: ignore[no-untyped-def]
    rows,
    before,
    after,
    best,
    fading,
    phase_cost,
    near,
    near_cost,
    move_cost,
    shape,
    similarity,
    row,
    leading,
):
    """
    Compute the scores of a frame from those of the frame before, at the same placements.

    score = fading * max over predecessors (score before - cost of the transition) + similarity,
    with the maximum taken axis by axis, which is exact because the costs add up.

    :param rows: (R, n) int16, scores of sequences, the first P * N used: phase by phase those of N
        placements with filling.
    :param before: (V,) int32, the rows of the frame before, -1 for sequences that were not
        searched, which are at the floor; all of them: there was no frame before.
    :param after: (V,) int32, the rows to put the result into, -1 for sequences that are not
        searched; other ones than those of ``before``.
    :param best: int16, the largest of them.
    :param fading: int16, factor on old scores, in 1/32768.
    :param phase_cost: (D,) int16, cost of advancing by 0, 1, ... phases.
    :param near: (V, M) int32 and ``near_cost`` (V, M) int16, see :func:`view_changes`.
    :param move_cost: int16, cost of moving the placement by one step.
    :param shape: (S, rows, columns) of the placements.
    :param similarity: (R, N) int16, what is added.
    :param row: (V * P,) int32, where in it a template is.
    :param leading: (V, P) int16, largest score of each template, result.
    """
    views, phases, lanes = len(after), leading.shape[1], similarity.shape[1]
    level = shape[1] * shape[2]
    used = shape[0] * level
    started = False
    for view in range(views):
        started |= before[view] >= 0
    walls = _walls(shape, lanes, move_cost)
    reached = np.empty((views, lanes), np.int16)
    reached[:] = FLOOR
    # Neighbouring placements of the first and last are read from a margin.
    size = lanes + 2 * level
    start, across, along = (
        np.empty(size, np.int16),
        np.empty(size, np.int16),
        np.empty(size, np.int16),
    )
    start[:], across[:], along[:] = FLOOR, FLOOR, _NOWHERE
    inner = slice(level, level + lanes)
    for phase in range(phases):
        if started:
            for view in range(views):
                if before[view] >= 0:
                    _earlier_phases(rows[before[view]], phases, phase, phase_cost, reached[view])
        for view in range(views):
            if after[view] < 0:
                leading[view, phase] = FLOOR
                continue
            result = rows[after[view], phase * lanes : (phase + 1) * lanes]
            gain = similarity[row[view * phases + phase]]
            if started:
                _copy(reached[view], start[inner])
                for m in range(near.shape[1]):
                    other = near[view, m]
                    if other >= 0 and before[other] >= 0:
                        _other_view(reached[other], near_cost[view, m], start[inner])
                _either_side(start, level, 1, walls[0], walls[1], across)
                _either_side(across, level, shape[2], walls[2], walls[3], along)
                # The last body height would take the filling for one more.
                along[level + used : level + lanes] = _NOWHERE
                _fade(along, level, move_cost, best, fading, gain, result)
            else:
                _copy(gain, result)
            result[used:] = FLOOR
            leading[view, phase] = _largest(result)


@kernel()
def _walls(shape, lanes, move_cost):  # type: ignore[no-untyped-def]
    """Return the costs of coming from the left, right, above and below, (4, N) int16."""
    scales, rows, columns = shape
    walls = np.empty((4, lanes), np.int16)
    walls[:] = move_cost
    for scale in range(scales):
        first = scale * rows * columns
        for row in range(rows):
            walls[0, first + row * columns] = _WALL
            walls[1, first + (row + 1) * columns - 1] = _WALL
        for column in range(columns):
            walls[2, first + column] = _WALL
            walls[3, first + (rows - 1) * columns + column] = _WALL
    return walls


@kernel()
def _copy(source, result):  # type: ignore[no-untyped-def]
    for j in range(len(result)):
        result[j] = source[j]


@kernel()
def _earlier_phases(before, phases, phase, phase_cost, reached):  # type: ignore[no-untyped-def]
    """Let states of a phase, (N,), come from this phase and those before it."""
    lanes = len(reached)
    before = before[: phases * lanes].reshape(phases, lanes)
    same, stay = before[phase], phase_cost[0]
    one = min(1, len(phase_cost) - 1)
    last, step = before[(phase - one) % phases], phase_cost[one]
    for j in range(lanes):
        reached[j] = max(np.int16(same[j] - stay), np.int16(last[j] - step))
    for back in range(2, len(phase_cost)):
        older, cost = before[(phase - back) % phases], phase_cost[back]
        for j in range(lanes):
            reached[j] = max(reached[j], np.int16(older[j] - cost))


@kernel()
def _other_view(other, cost, result):  # type: ignore[no-untyped-def]
    """Let states come from another view."""
    for j in range(len(result)):
        result[j] = max(result[j], np.int16(other[j] - cost))


@kernel()
def _either_side(row, first, offset, low_cost, high_cost, result):  # type: ignore[no-untyped-def]
    """Let placements come from ``offset`` before or after."""
    size = len(low_cost)
    here, there = row[first : first + size], result[first : first + size]
    low, high = row[first - offset : first - offset + size], row[first + offset :]
    for j in range(size):
        side = max(np.int16(low[j] - low_cost[j]), np.int16(high[j] - high_cost[j]))
        there[j] = max(here[j], side)


@kernel()
def _fade(row, level, move_cost, best, fading, gain, result):  # type: ignore[no-untyped-def]
    """Let placements come from the next body heights, and make new scores of the old ones."""
    size = len(result)
    here, low, high = row[level : level + size], row[:size], row[2 * level :]
    for j in range(size):
        side = np.int16(max(low[j], high[j]) - move_cost)
        value = max(np.int16(max(here[j], side) - best), np.int16(FLOOR))
        twice = np.int16(value + value)
        faded = np.int16((np.int32(twice) * np.int32(fading)) >> np.int32(16))
        result[j] = np.int16(faded + gain[j])


@kernel()
def _largest(scores):  # type: ignore[no-untyped-def]
    largest = scores[0]
    for j in range(len(scores)):
        largest = max(largest, scores[j])
    return largest


@kernel(
    'i2[:,::1], i4[::1], i4[::1], i8, UniTuple(i8, 3), UniTuple(i8, 3), UniTuple(i8, 2), i8[::1]'
)
def shifted(rows, before, after, phases, old, new, lanes, shift):  # type: ignore[no-untyped-def]
    """
    Move all scores by whole placements.

    :param rows: (R, n) int16, scores of sequences.
    :param before: (V,) int32, the rows to move, -1 for sequences that are at the floor.
    :param after: (V,) int32, the rows to put the result into; what comes from beyond the range
        searched before is at the floor.
    :param phases: P.
    :param old: (S, rows, columns) of the placements searched before, and ``new`` of those to be.
    :param lanes: numbers of the former and of the latter with filling.
    :param shift: (3,) int64; the score of a placement is taken from placement + shift.
    """
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for axis in range(3):
        low[axis] = max(-shift[axis], 0)
        high[axis] = min(old[axis] - shift[axis], new[axis])
    for view in range(len(before)):
        if before[view] < 0:
            continue
        for phase in range(phases):
            source = rows[before[view], phase * lanes[0] : (phase + 1) * lanes[0]]
            target = rows[after[view], phase * lanes[1] : (phase + 1) * lanes[1]]
            target[:] = FLOOR
            for scale in range(low[0], high[0]):
                for line in range(low[1], high[1]):
                    here = (scale * new[1] + line) * new[2]
                    come = ((scale + shift[0]) * old[1] + line + shift[1]) * old[2] + shift[2]
                    for column in range(low[2], high[2]):
                        target[here + column] = source[come + column]
