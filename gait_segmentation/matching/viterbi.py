# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Steps of the search over all states, forward and back, in whole numbers of 16 bits throughout.

The scores of a frame are (V, P * N) int16, of each sequence phase by phase those of N placements
with filling.

All loops over placements run over different, contiguous arrays and do nothing but 16-bit
arithmetic, so that the vector unit treats 16 or 32 placements at a time.
"""

from __future__ import annotations

import numpy as np

from gait_segmentation.kernels import kernel

FLOOR = -12000
"""
Worst score relative to the best: nearly six times a similarity of 1.  Twice of it and what any
transition costs below it, also a wall, still fit 16 bits.
"""
_WALL = -FLOOR  # cost of coming from beyond the border: whatever pays it falls to the floor
# Score of body heights there are not: at the floor, also where the best score is negative.
_NOWHERE = 2 * FLOOR


@kernel(
    'i2[:,::1], i2[:,::1], i2, i2, i2[::1], i4[:,::1], i2[:,::1], i2, '
    'UniTuple(i8, 3), i2[:,::1], i4[::1], i2[:,::1]'
)
def advance(  # type: ignore[no-untyped-def]
    old, new, best, fading, phase_cost, near, near_cost, move_cost, shape, similarity, row, leading
):
    """
    Compute the scores of a frame from those of the frame before, at the same placements.

    score = fading * max over predecessors (score before - cost of the transition) + similarity,
    with the maximum taken axis by axis, which is exact because the costs add up.

    :param old: scores of the frame before, without rows if there was none.
    :param new: scores of this frame, written.
    :param best: int16, the largest of the old scores.
    :param fading: int16, factor on old scores, in 1/32768.
    :param phase_cost: (D,) int16, cost of advancing by 0, 1, ... phases.
    :param near: (V, M) int32 and ``near_cost`` (V, M) int16, see :func:`view_changes`.
    :param move_cost: int16, cost of moving the placement by one step.
    :param shape: (S, rows, columns) of the placements.
    :param similarity: (R, N) int16, what is added.
    :param row: (V * P,) int32, where in it a template is.
    :param leading: (V, P) int16, largest score of each template, result.
    """
    views, phases, lanes = len(new), leading.shape[1], similarity.shape[1]
    level = shape[1] * shape[2]
    used = shape[0] * level
    started = len(old) > 0
    walls = _walls(shape, lanes, move_cost)
    reached = np.empty((views, lanes), np.int16)
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
                _earlier_phases(old[view], phases, phase, phase_cost, reached[view])
        for view in range(views):
            result = new[view, phase * lanes : (phase + 1) * lanes]
            gain = similarity[row[view * phases + phase]]
            if started:
                _copy(reached[view], start[inner])
                for m in range(near.shape[1]):
                    other = near[view, m]
                    if other >= 0:
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


@kernel('i2[:,::1], i2[:,::1], i8, UniTuple(i8, 3), UniTuple(i8, 3), UniTuple(i8, 2), i8[::1]')
def shifted(before, after, phases, old, new, lanes, shift):  # type: ignore[no-untyped-def]
    """
    Move all scores by whole placements.

    :param before: scores, and ``after`` likewise, written; what comes from beyond the range
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
    for row in range(len(before)):
        for phase in range(phases):
            source = before[row, phase * lanes[0] : (phase + 1) * lanes[0]]
            target = after[row, phase * lanes[1] : (phase + 1) * lanes[1]]
            target[:] = FLOOR
            for scale in range(low[0], high[0]):
                for line in range(low[1], high[1]):
                    here = (scale * new[1] + line) * new[2]
                    come = ((scale + shift[0]) * old[1] + line + shift[1]) * old[2] + shift[2]
                    for column in range(low[2], high[2]):
                        target[here + column] = source[come + column]


@kernel(
    'i2[:,::1], i2[::1], UniTuple(i8, 3), UniTuple(i8, 3), i8, i8, i4[:,::1], '
    'i2[:,::1], i8, i8[::1], i8[::1]'
)
def step_back(  # type: ignore[no-untyped-def]
    scores, phase_cost, first, shape, lanes, phases, near, near_cost, move_cost, state, result
):
    """
    Find the best predecessor of a state.

    :param scores: those of the frame before.
    :param phase_cost: (D,) int16, cost of advancing by 0, 1, ... phases.
    :param first: body height, row and column of the first placement searched before, and
        ``shape`` how many of each.
    :param lanes: their number with filling.
    :param near: (V, M) int32 and ``near_cost`` (V, M) int16, see :func:`view_changes`.
    :param state: (5,) int64, sequence, phase, scale, row, column; ``result`` likewise, written.
    """
    scales, rows, columns = shape
    view, phase = state[0], state[1]
    here = state[2] - first[0], state[3] - first[1], state[4] - first[2]
    largest = np.int64(-(1 << 40))
    for option in range(near.shape[1] + 1):
        from_view = view if option == 0 else np.int64(near[view, option - 1])
        if from_view < 0:
            continue
        turn = np.int64(0) if option == 0 else np.int64(near_cost[view, option - 1])
        for step in range(len(phase_cost)):
            from_phase = (phase - step) % phases
            known = turn + phase_cost[step]
            for move in range(27):
                # Order of the 27 moves: no move first, so that ties stay in place.
                code = (move + 13) % 27
                ds, dy, dx = code // 9 - 1, code // 3 % 3 - 1, code % 3 - 1
                scale, row, column = here[0] + ds, here[1] + dy, here[2] + dx
                if not (0 <= scale < scales and 0 <= row < rows and 0 <= column < columns):
                    continue
                lane = (scale * rows + row) * columns + column
                moved = move_cost * (abs(ds) + abs(dy) + abs(dx))
                score = np.int64(scores[from_view, from_phase * lanes + lane])
                value = score - known - moved
                if value > largest:
                    largest = value
                    result[0], result[1] = from_view, from_phase
                    result[2], result[3], result[4] = scale, row, column
    if largest == -(1 << 40):
        # Not searched before: the nearest placement takes over.
        least = 0
        for step in range(len(phase_cost)):
            if phase_cost[step] < phase_cost[least]:
                least = step
        result[0], result[1] = view, (phase - least) % phases
        result[2] = min(max(here[0], 0), scales - 1)
        result[3] = min(max(here[1], 0), rows - 1)
        result[4] = min(max(here[2], 0), columns - 1)
    for k in range(3):
        result[2 + k] += first[k]
