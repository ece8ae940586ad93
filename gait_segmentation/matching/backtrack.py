# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The way back from the last state of a path, through the scores of all its frames."""

from __future__ import annotations

import numpy as np

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.scores import FLOOR

__all__ = ['trace']


@kernel(
    'i2[:,::1], i4[:,::1], i8[::1], i2[:,::1], i8[::1], i8[:,::1], i8[:,::1], i4[:,::1], '
    'i2[:,::1], i8, i8[:,::1], i8[:,::1]'
)
def trace(  # type: ignore[no-untyped-def]
    rows,
    where,
    slots,
    phase_costs,
    counts,
    shifts,
    ranges,
    near,
    near_cost,
    move_cost,
    known,
    path,
):
    """
    Follow the best predecessors back from the last state of a path.

    :param rows: (R, n) int16, scores of sequences, phase by phase those of N placements.
    :param where: (slots, V) int32, the rows of a frame, -1 for what is at the floor.
    :param slots: (F,) int64, where the frames are, oldest first.
    :param phase_costs: (slots, D) int16 and ``counts`` (slots,) int64: costs of the step to the
        frame of a slot, and how many there are.
    :param shifts: (slots, 3) int64, how far the box jumped, in placements.
    :param ranges: (slots, 7) int64, what was searched in a frame: its first body height, row and
        column, how many of each, and N.
    :param known: (M, 5) int64, the path traced back before through the first M of the frames:
        where the new one meets it they are the same.
    :param path: (F, 5) int64, view, phase, scale, row, column; the last row is given.
    """
    for frame in range(len(slots) - 1, 0, -1):
        if frame < len(known):
            same = True
            for k in range(5):
                same &= path[frame, k] == known[frame, k]
            if same:
                for earlier in range(frame):
                    for k in range(5):
                        path[earlier, k] = known[earlier, k]
                return
        slot, last = slots[frame], slots[frame - 1]
        _step_back(
            rows,
            where[last],
            phase_costs[slot, : counts[slot]],
            shifts[slot],
            ranges[last],
            phase_costs.shape[1],
            near,
            near_cost,
            move_cost,
            path[frame],
            path[frame - 1],
        )


@kernel()
def _step_back(  # type: ignore[no-untyped-def]
    scores, where, phase_cost, shift, searched, phases, near, near_cost, move_cost, state, result
):
    """Find the best predecessor of a state."""
    first, lanes = searched[:3], searched[6]
    scales, rows, columns = searched[3], searched[4], searched[5]
    view, phase = state[0], state[1]
    here = (
        state[2] + shift[0] - first[0],
        state[3] + shift[1] - first[1],
        state[4] + shift[2] - first[2],
    )
    largest = np.int64(-(1 << 40))
    for option in range(near.shape[1] + 1):
        from_view = view if option == 0 else np.int64(near[view, option - 1])
        if from_view < 0:
            continue
        turn = np.int64(0) if option == 0 else np.int64(near_cost[view, option - 1])
        row_of = where[from_view]
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
                score = np.int64(
                    scores[row_of, from_phase * lanes + lane] if row_of >= 0 else FLOOR
                )
                value = score - known - moved
                if value > largest:
                    largest = value
                    result[0], result[1] = from_view, from_phase
                    result[2], result[3], result[4] = scale, row, column
    if largest == -(1 << 40):
        # The box jumped out of the search range: the nearest placement takes over.
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
