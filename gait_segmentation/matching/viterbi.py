# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One step of the search over all states, and the way back; whole numbers throughout."""

from __future__ import annotations

import numpy as np
from numba import njit

from gait_segmentation.matching.transitions import UNIT

__all__ = ['FLOOR', 'advance', 'shifted', 'trace']

FLOOR = -12000
"""Worst score relative to the best: nearly six times a similarity of 1."""

_WALL = 18000
_HUGE = 2**29


@njit(cache=True, nogil=True)
def advance(  # type: ignore[no-untyped-def]
    before,
    best,
    fading,
    phase_cost,
    near,
    near_cost,
    active,
    was_active,
    move_cost,
    shape,
    common,
    common_row,
    window_area,
    template_area,
    visible,
    minimum_visible,
    placement_cost,
    after,
    leading,
):
    """
    Compute the scores of a frame from those of the frame before.

    score = fading * max over predecessors (score before - cost of the transition) + similarity,
    with the maximum taken axis by axis, which is exact because the costs add up.  N = S * L
    counts the placements with filling, L >= rows * columns for each of S body heights.

    :param before: (V, P, N) int16 scores of the frame before; (0, P, N) = no frame before.
    :param best: the largest of them.
    :param fading: factor on old scores, in 1/32768.
    :param phase_cost: (D,) int16, cost of advancing by 0, 1, ... phases.
    :param near: (V, M) int32 and ``near_cost`` (V, M) int16, see :func:`view_changes`.
    :param active: (V,) bool, sequences that are searched; the others go to the floor.
    :param was_active: (V,) bool, the same in the frame before.
    :param move_cost: int16, cost of moving the placement by one step.
    :param shape: (S, rows, columns) of the placements.
    :param common: (S, R, L) int32, C.
    :param common_row: (V * P,) int32, where in it a template is.
    :param window_area: (N,) int32, F.
    :param template_area: (V * P,) int32, G.
    :param visible: (S, R, L) int32, G over the known pixels; (0, R, L) = all known.
    :param minimum_visible: share of G below which a placement does not count.
    :param placement_cost: (N,) int16, what a placement costs in every frame.
    :param after: (V, P, N) int16, result.
    :param leading: (V, P) int16, largest score of each template, result.
    """
    views, phases, size = after.shape
    columns = shape[2]
    lanes = size // shape[0]
    started = before.shape[0] > 0
    walls = _walls(shape, lanes, move_cost)
    reached = np.empty((views, size), np.int16)
    row0 = np.full(size + 2 * lanes, FLOOR, np.int16)
    row1 = np.full(size + 2 * lanes, FLOOR, np.int16)
    row2 = np.full(size + 2 * lanes, FLOOR, np.int16)
    seen = np.empty(lanes, np.int32)
    for phase in range(phases):
        if started:
            for view in range(views):
                if was_active[view]:
                    _earlier_phases(before[view], phase, phase_cost, reached[view])
                else:
                    reached[view] = FLOOR
        for view in range(views):
            template = view * phases + phase
            result = after[view, phase]
            if not active[view]:
                result[:] = FLOOR
                leading[view, phase] = FLOOR
                continue
            if started:
                own = row0[lanes : lanes + size]
                own[:] = reached[view]
                for m in range(near.shape[1]):
                    if near[view, m] >= 0:
                        other, turn = reached[near[view, m]], near_cost[view, m]
                        for j in range(size):
                            own[j] = max(own[j], np.int16(other[j] - turn))
                _either_side(row0, lanes, 1, walls[0], walls[1], row1)
                _either_side(row1, lanes, columns, walls[2], walls[3], row2)
                _fade(row2, lanes, move_cost, best, fading, result)
            else:
                result[:] = 0
            row, whole = common_row[template], template_area[template]
            least = np.int32(minimum_visible * whole)
            for scale in range(shape[0]):
                part = slice(scale * lanes, (scale + 1) * lanes)
                shared, area, costs = common[scale, row], window_area[part], placement_cost[part]
                if visible.shape[0] == 0:
                    _add_similarity(shared, area, whole, costs, result[part])
                    continue
                for j in range(lanes):
                    # A template out of sight gets an area that no likelihood can be like.
                    part_seen = visible[scale, row, j]
                    seen[j] = _HUGE if part_seen < least else part_seen
                _add_similarity_seen(shared, area, seen, costs, result[part])
            leading[view, phase] = _largest_used(result, shape, lanes)


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
def _earlier_phases(before, phase, phase_cost, reached):  # type: ignore[no-untyped-def]
    phases = before.shape[0]
    old, cost = before[phase], phase_cost[0]
    for j in range(len(reached)):
        reached[j] = old[j] - cost
    for step in range(1, len(phase_cost)):
        old, cost = before[(phase - step) % phases], phase_cost[step]
        for j in range(len(reached)):
            reached[j] = max(reached[j], np.int16(old[j] - cost))


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
def _fade(row, lanes, move_cost, best, fading, result):  # type: ignore[no-untyped-def]
    """Let placements come from the next body heights, make scores relative, and fade them."""
    size = len(result)
    here, low, high = row[lanes : lanes + size], row[:size], row[2 * lanes :]
    for j in range(size):
        side = np.int16(max(low[j], high[j]) - move_cost)
        value = np.int32(max(here[j], side)) - np.int32(best)
        value = max(value, np.int32(FLOOR))
        result[j] = np.int16((value * np.int32(fading)) >> np.int32(15))


@njit(cache=True, nogil=True)
def _add_similarity(shared, area, whole, cost, result):  # type: ignore[no-untyped-def]
    for j in range(len(result)):
        joint = max(np.int32(area[j] + whole - shared[j]), np.int32(1))
        share = np.float32(shared[j]) / np.float32(joint)
        result[j] += np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost[j])


@njit(cache=True, nogil=True)
def _add_similarity_seen(shared, area, whole, cost, result):  # type: ignore[no-untyped-def]
    for j in range(len(result)):
        joint = max(np.int32(area[j] + whole[j] - shared[j]), np.int32(1))
        share = np.float32(shared[j]) / np.float32(joint)
        result[j] += np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost[j])


@njit(cache=True, nogil=True)
def _largest_used(result, shape, lanes):  # type: ignore[no-untyped-def]
    """Put the filling to the floor and return the largest score."""
    for scale in range(shape[0]):
        result[scale * lanes + shape[1] * shape[2] : (scale + 1) * lanes] = FLOOR
    largest = result[0]
    for j in range(len(result)):
        largest = max(largest, result[j])
    return largest


@njit(cache=True, nogil=True)
def shifted(scores, shape, shift, result):  # type: ignore[no-untyped-def]
    """
    Move all scores by whole placements, for a box that jumped.

    :param scores: (V, P, N) int16, N = S * L.
    :param shape: (S, rows, columns).
    :param shift: (3,) int64; the score of a placement is taken from placement + shift.
    :param result: like ``scores``; what comes from beyond the search range is at the floor.
    """
    scales, rows, columns = shape
    lanes = scores.shape[2] // scales
    result[:] = FLOOR
    for view in range(scores.shape[0]):
        for phase in range(scores.shape[1]):
            for scale in range(scales):
                other = scale + shift[0]
                if not 0 <= other < scales:
                    continue
                for row in range(rows):
                    from_row = row + shift[1]
                    if not 0 <= from_row < rows:
                        continue
                    for column in range(columns):
                        from_column = column + shift[2]
                        if 0 <= from_column < columns:
                            result[view, phase, scale * lanes + row * columns + column] = scores[
                                view, phase, other * lanes + from_row * columns + from_column
                            ]


@njit(cache=True, nogil=True)
def trace(  # type: ignore[no-untyped-def]
    ring,
    slots,
    phase_costs,
    counts,
    shifts,
    near,
    near_cost,
    move_cost,
    shape,
    path,
):
    """
    Follow the best predecessors back from the last state of a path.

    :param ring: (slots, V, P, N) int16 scores, N = S * L.
    :param slots: (N,) int64, where in the ring the frames are, oldest first.
    :param phase_costs: (N, D) int16 and ``counts`` (N,) int64: costs of the step to each frame.
    :param shifts: (N, 3) int64, see :func:`shifted`.
    :param path: (N, 5) int64, view, phase, scale, row, column; the last row is given.
    """
    scales, rows, columns = shape
    phases = ring.shape[2]
    lanes = ring.shape[3] // scales
    for frame in range(len(slots) - 1, 0, -1):
        scores = ring[slots[frame - 1]]
        view, phase = path[frame, 0], path[frame, 1]
        here = path[frame, 2:] + shifts[frame]
        largest = np.int64(-(1 << 40))
        for option in range(near.shape[1] + 1):
            from_view = view if option == 0 else np.int64(near[view, option - 1])
            if from_view < 0:
                continue
            turn = np.int64(0) if option == 0 else np.int64(near_cost[view, option - 1])
            for step in range(counts[frame]):
                from_phase = (phase - step) % phases
                known = turn + phase_costs[frame, step]
                for move in range(27):
                    # Order of the 27 moves: no move first, so that ties stay in place.
                    code = (move + 13) % 27
                    ds, dy, dx = code // 9 - 1, code // 3 % 3 - 1, code % 3 - 1
                    scale, row, column = here[0] + ds, here[1] + dy, here[2] + dx
                    if not (0 <= scale < scales and 0 <= row < rows and 0 <= column < columns):
                        continue
                    value = (
                        np.int64(
                            scores[from_view, from_phase, scale * lanes + row * columns + column]
                        )
                        - known
                        - move_cost * (abs(ds) + abs(dy) + abs(dx))
                    )
                    if value > largest:
                        largest = value
                        path[frame - 1, 0] = from_view
                        path[frame - 1, 1] = from_phase
                        path[frame - 1, 2] = scale
                        path[frame - 1, 3] = row
                        path[frame - 1, 4] = column
        if largest == -(1 << 40):
            # The box jumped out of the search range: the nearest placement takes over.
            path[frame - 1, 0] = view
            path[frame - 1, 1] = (phase - np.argmin(phase_costs[frame, : counts[frame]])) % phases
            path[frame - 1, 2] = min(max(here[0], 0), scales - 1)
            path[frame - 1, 3] = min(max(here[1], 0), rows - 1)
            path[frame - 1, 4] = min(max(here[2], 0), columns - 1)
