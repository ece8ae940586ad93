# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
One step of the search over all states, in whole numbers of 16 bits throughout.

All loops over placements run over different, contiguous arrays and do nothing but 16-bit
arithmetic, so that the vector unit treats 16 or 32 placements at a time.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gait_segmentation.matching.scores import FLOOR

__all__ = ['advance', 'shifted']

_WALL = -FLOOR
"""Cost of coming from beyond the border: whatever pays it falls to the floor."""


@njit(cache=True, nogil=True)
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
    lowest,
    highest,
    leading,
):
    """
    Compute the scores of a frame from those of the frame before.

    score = fading * max over predecessors (score before - cost of the transition) + similarity,
    with the maximum taken axis by axis, which is exact because the costs add up.  N = S * L
    counts the placements with filling, L >= rows * columns for each of S body heights.

    :param rows: (R, P, N) int16, scores of sequences.
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
    :param lowest: the first body height that is searched, and ``highest`` the last one; the
        scores of others are left as they are.
    :param leading: (V, P) int16, largest score of each template, result.
    """
    views, phases, everywhere = len(after), rows.shape[1], rows.shape[2]
    columns = shape[2]
    lanes = everywhere // shape[0]
    start, stop = lowest * lanes, (highest + 1) * lanes
    size = stop - start
    part = highest + 1 - lowest, shape[1], columns
    started = before.max() >= 0
    walls = _walls(part, lanes, move_cost)
    reached = np.full((views, size), FLOOR, np.int16)
    # Neighbouring placements of the first and last are read from a margin.
    turned = np.full(size + 2 * lanes, FLOOR, np.int16)
    across = np.full(size + 2 * lanes, FLOOR, np.int16)
    along = np.full(size + 2 * lanes, FLOOR, np.int16)
    inner = slice(lanes, lanes + size)
    others = np.empty(near.shape[1] + 1, np.int64)
    turns = np.zeros(near.shape[1] + 1, np.int16)
    for phase in range(phases):
        if started:
            for view in range(views):
                if before[view] >= 0:
                    _earlier_phases(rows[before[view]], start, phase, phase_cost, reached[view])
        for view in range(views):
            if after[view] < 0:
                leading[view, phase] = FLOOR
                continue
            result = rows[after[view], phase, start:stop]
            gain = similarity[row[view * phases + phase], start:stop]
            if not started:
                _copy(gain, result)
                leading[view, phase] = _largest_used(result, part, lanes)
                continue
            found = 0
            for m in range(near.shape[1]):
                if near[view, m] >= 0 and before[near[view, m]] >= 0:
                    others[found], turns[found] = near[view, m], near_cost[view, m]
                    found += 1
            if found == 0 or found % 2 == 1:
                others[found], turns[found] = view, 0
                found += 1
            if found == 1:
                _copy(reached[view], turned[inner])
            for m in range(0, found - 1, 2):
                first, second = reached[others[m]], reached[others[m + 1]]
                if m == 0:
                    own = reached[view]
                    _other_views(own, first, turns[m], second, turns[m + 1], turned[inner])
                else:
                    _more_views(first, turns[m], second, turns[m + 1], turned[inner])
            _either_side(turned, lanes, 1, walls[0], walls[1], across)
            _either_side(across, lanes, columns, walls[2], walls[3], along)
            _fade(along, lanes, move_cost, best, fading, gain, result)
            leading[view, phase] = _largest_used(result, part, lanes)


@njit(cache=True, nogil=True)
def _walls(shape, lanes, move_cost):  # type: ignore[no-untyped-def]
    """Return the costs of coming from the left, right, above and below, (4, N) int16."""
    scales, rows, columns = shape
    walls = np.full((4, scales * lanes), move_cost, np.int16)
    for scale in range(scales):
        first = scale * lanes
        for row in range(rows):
            walls[0, first + row * columns] = _WALL
            walls[1, first + (row + 1) * columns - 1] = _WALL
        for column in range(columns):
            walls[2, first + column] = _WALL
            walls[3, first + (rows - 1) * columns + column] = _WALL
    return walls


@njit(cache=True, nogil=True)
def _copy(source, result):  # type: ignore[no-untyped-def]
    for j in range(len(result)):
        result[j] = source[j]


@njit(cache=True, nogil=True)
def _earlier_phases(before, start, phase, phase_cost, reached):  # type: ignore[no-untyped-def]
    """Let states from ``start`` on come from this phase and those before it."""
    phases, stop = before.shape[0], start + len(reached)
    same, stay = before[phase, start:stop], phase_cost[0]
    one = min(1, len(phase_cost) - 1)
    last, step = before[(phase - one) % phases, start:stop], phase_cost[one]
    for j in range(len(reached)):
        reached[j] = max(np.int16(same[j] - stay), np.int16(last[j] - step))
    for back in range(2, len(phase_cost)):
        older, cost = before[(phase - back) % phases, start:stop], phase_cost[back]
        for j in range(len(reached)):
            reached[j] = max(reached[j], np.int16(older[j] - cost))


@njit(cache=True, nogil=True)
def _other_views(own, first, first_cost, second, second_cost, result):  # type: ignore[no-untyped-def]
    """Let views come from two others."""
    for j in range(len(result)):
        other = max(np.int16(first[j] - first_cost), np.int16(second[j] - second_cost))
        result[j] = max(own[j], other)


@njit(cache=True, nogil=True)
def _more_views(first, first_cost, second, second_cost, result):  # type: ignore[no-untyped-def]
    """Let views come from two more."""
    for j in range(len(result)):
        other = max(np.int16(first[j] - first_cost), np.int16(second[j] - second_cost))
        result[j] = max(result[j], other)


@njit(cache=True, nogil=True)
def _either_side(row, first, offset, low_cost, high_cost, result):  # type: ignore[no-untyped-def]
    """Let placements come from ``offset`` before or after."""
    size = len(low_cost)
    here, there = row[first : first + size], result[first : first + size]
    low, high = row[first - offset : first - offset + size], row[first + offset :]
    for j in range(size):
        side = max(np.int16(low[j] - low_cost[j]), np.int16(high[j] - high_cost[j]))
        there[j] = max(here[j], side)


@njit(cache=True, nogil=True)
def _fade(row, lanes, move_cost, best, fading, gain, result):  # type: ignore[no-untyped-def]
    """Let placements come from the next body heights, and make new scores of the old ones."""
    size = len(result)
    here, low, high = row[lanes : lanes + size], row[:size], row[2 * lanes :]
    for j in range(size):
        side = np.int16(max(low[j], high[j]) - move_cost)
        value = max(np.int16(max(here[j], side) - best), np.int16(FLOOR))
        twice = np.int16(value + value)
        faded = np.int16((np.int32(twice) * np.int32(fading)) >> np.int32(16))
        result[j] = np.int16(faded + gain[j])


@njit(cache=True, nogil=True)
def _largest_used(result, shape, lanes):  # type: ignore[no-untyped-def]
    """Put the filling to the floor and return the largest score."""
    for scale in range(shape[0]):
        for j in range(scale * lanes + shape[1] * shape[2], (scale + 1) * lanes):
            result[j] = FLOOR
    largest = result[0]
    for j in range(len(result)):
        largest = max(largest, result[j])
    return largest


@njit(cache=True, nogil=True)
def shifted(rows, before, after, shape, shift, lowest, highest):  # type: ignore[no-untyped-def]
    """
    Move all scores by whole placements, for a box that jumped.

    :param rows: (R, P, N) int16, scores of sequences, N = S * L.
    :param before: (V,) int32, the rows to move, -1 for sequences that are at the floor.
    :param after: (V,) int32, the rows to put the result into; what comes from beyond the search
        range is at the floor.
    :param shape: (S, rows, columns).
    :param shift: (3,) int64; the score of a placement is taken from placement + shift.
    :param lowest: the first body height to fill, and ``highest`` the last one; the heights that
        their scores come from must be there.
    """
    scales, lines, columns = shape
    lanes, used = rows.shape[2] // scales, lines * columns
    offset = shift[1] * columns + shift[2]
    first, last = max(-offset, 0), max(min(used - offset, used), 0)
    # Columns beyond which there is nothing: what has been moved there comes from the next line.
    start, stop = min(max(-shift[2], 0), columns), max(min(columns - shift[2], columns), 0)
    for view in np.flatnonzero(before >= 0):
        for phase in range(rows.shape[1]):
            for scale in range(lowest, highest + 1):
                come = scale + shift[0]
                source = rows[before[view], phase, come * lanes : (come + 1) * lanes]
                target = rows[after[view], phase, scale * lanes : (scale + 1) * lanes]
                target[:] = FLOOR
                if first < last:
                    _copy(source[first + offset : last + offset], target[first:last])
                for line in range(lines):
                    for column in range(start):
                        target[line * columns + column] = FLOOR
                    for column in range(stop, columns):
                        target[line * columns + column] = FLOOR
