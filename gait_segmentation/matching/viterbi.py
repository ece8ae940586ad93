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
_GUARD = 64


@njit(cache=True, nogil=True)
def advance(  # type: ignore[no-untyped-def]
    before,
    best,
    fading,
    phase_cost,
    near,
    near_cost,
    move_cost,
    shape,
    common,
    window_area,
    template_area,
    visible,
    minimum_visible,
    after,
    leading,
):
    """
    Compute the scores of a frame from those of the frame before.

    score = fading * max over predecessors (score before - cost of the transition) + similarity,
    with the maximum taken axis by axis, which is exact because the costs add up.

    :param before: (V, P, S, L) int16 scores of the frame before; empty = no frame before.
    :param best: the largest of them.
    :param fading: factor on old scores, in 1/32768.
    :param phase_cost: (D,) int16, cost of advancing by 0, 1, ... phases.
    :param near: (V, M) int32 and ``near_cost`` (V, M) int16, see :func:`view_changes`.
    :param move_cost: cost of moving the placement by one step.
    :param shape: (S, rows, columns) of the placements; rows * columns <= L.
    :param common: (V * P, S, L) int32, C.
    :param window_area: (S, L) int32, F.
    :param template_area: (V * P,) int32, G.
    :param visible: (V * P, S, L) int32, G over the known pixels; empty = all known.
    :param minimum_visible: share of G below which a placement does not count.
    :param after: (V, P, S, L) int16, result.
    :param leading: (V, P) int16, largest score of each template, result.
    """
    views, phases, scales, lanes = after.shape
    rows, columns = shape[1], shape[2]
    used = rows * columns
    started = before.shape[0] > 0
    left = np.full(lanes, move_cost, np.int16)
    right = np.full(lanes, move_cost, np.int16)
    for row in range(rows):
        left[row * columns] = _WALL
        right[row * columns + columns - 1] = _WALL
    reached = np.empty((views, scales, lanes), np.int16)
    row0 = np.full(lanes + 2 * _GUARD, FLOOR, np.int16)
    row1 = np.full(lanes + 2 * _GUARD, FLOOR, np.int16)
    moved = np.empty((scales, lanes), np.int16)
    cost = np.int16(move_cost)
    for phase in range(phases):
        if started:
            for view in range(views):
                for scale in range(scales):
                    target = reached[view, scale]
                    old = before[view, phase, scale]
                    step_cost = phase_cost[0]
                    for j in range(lanes):
                        target[j] = old[j] - step_cost
                    for step in range(1, len(phase_cost)):
                        old = before[view, (phase - step) % phases, scale]
                        step_cost = phase_cost[step]
                        for j in range(lanes):
                            target[j] = max(target[j], np.int16(old[j] - step_cost))
        for view in range(views):
            template = view * phases + phase
            if started:
                for scale in range(scales):
                    own = reached[view, scale]
                    for j in range(lanes):
                        row0[_GUARD + j] = own[j]
                    for m in range(near.shape[1]):
                        if near[view, m] >= 0:
                            other = reached[near[view, m], scale]
                            turn = near_cost[view, m]
                            for j in range(lanes):
                                row0[_GUARD + j] = max(row0[_GUARD + j], np.int16(other[j] - turn))
                    for j in range(lanes):
                        value = max(
                            np.int16(row0[_GUARD + j - 1] - left[j]),
                            np.int16(row0[_GUARD + j + 1] - right[j]),
                        )
                        row1[_GUARD + j] = max(row0[_GUARD + j], value)
                    for j in range(used, lanes):
                        row1[_GUARD + j] = FLOOR
                    target = moved[scale]
                    for j in range(lanes):
                        value = max(row1[_GUARD + j - columns], row1[_GUARD + j + columns])
                        target[j] = max(row1[_GUARD + j], np.int16(value - cost))
            largest = np.int16(-32768)
            for scale in range(scales):
                result = after[view, phase, scale]
                if started:
                    target = moved[scale]
                    for j in range(lanes):
                        result[j] = target[j]
                    for beside in (scale - 1, scale + 1):
                        if 0 <= beside < scales:
                            other = moved[beside]
                            for j in range(lanes):
                                result[j] = max(result[j], np.int16(other[j] - cost))
                    for j in range(lanes):
                        value = np.int32(result[j]) - np.int32(best)
                        value = max(value, np.int32(FLOOR))
                        result[j] = np.int16((value * np.int32(fading)) >> np.int32(15))
                else:
                    for j in range(lanes):
                        result[j] = 0
                shared = common[template, scale]
                area = window_area[scale]
                whole = template_area[template]
                if visible.shape[0] == 0:
                    for j in range(lanes):
                        joint = max(np.int32(area[j] + whole - shared[j]), np.int32(1))
                        share = np.float32(shared[j]) / np.float32(joint)
                        result[j] += np.int16(share * np.float32(UNIT) + np.float32(0.5))
                else:
                    seen = visible[template, scale]
                    least = np.int32(minimum_visible * whole)
                    for j in range(used):
                        joint = max(np.int32(area[j] + seen[j] - shared[j]), np.int32(1))
                        share = np.float32(shared[j]) / np.float32(joint)
                        if seen[j] < least:
                            share = np.float32(0.0)
                        result[j] += np.int16(share * np.float32(UNIT) + np.float32(0.5))
                for j in range(used, lanes):
                    result[j] = FLOOR
                for j in range(lanes):
                    largest = max(largest, result[j])
            leading[view, phase] = largest


@njit(cache=True, nogil=True)
def shifted(scores, shape, shift, result):  # type: ignore[no-untyped-def]
    """
    Move all scores by whole placements, for a box that jumped.

    :param scores: (V, P, S, L) int16.
    :param shape: (S, rows, columns).
    :param shift: (3,) int64; the score of a placement is taken from placement + shift.
    :param result: like ``scores``; what comes from beyond the search range is at the floor.
    """
    scales, rows, columns = shape
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
                            result[view, phase, scale, row * columns + column] = scores[
                                view, phase, other, from_row * columns + from_column
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

    :param ring: (slots, V, P, S, L) int16 scores.
    :param slots: (N,) int64, where in the ring the frames are, oldest first.
    :param phase_costs: (N, D) int16 and ``counts`` (N,) int64: costs of the step to each frame.
    :param shifts: (N, 3) int64, see :func:`shifted`.
    :param path: (N, 5) int64, view, phase, scale, row, column; the last row is given.
    """
    scales, rows, columns = shape
    phases = ring.shape[2]
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
                        np.int64(scores[from_view, from_phase, scale, row * columns + column])
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
