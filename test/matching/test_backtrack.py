# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from gait_segmentation.matching.backtrack import trace
from gait_segmentation.matching.scores import FLOOR

SHAPE, LANES, MOVE = (2, 2, 3), 15, 20
NEAR, TURN = np.array([[1], [0]], np.int32), np.array([[70], [90]], np.int16)
NOTHING = np.empty((0, 5), np.int64)


def lane(state):
    return (state[2] * SHAPE[1] + state[3]) * SHAPE[2] + state[4]


def clip(seed, frames=5, slots=7):
    rng = np.random.default_rng(seed)
    ring = rng.integers(-500, 500, (slots, 2, 3, LANES)).astype(np.int16)
    costs = rng.integers(0, 60, (slots, 3)).astype(np.int16)
    shifts = np.zeros((slots, 3), np.int64)
    return ring, rng.permutation(slots)[:frames], costs, np.full(slots, 2), shifts


def traced(data, last, known=NOTHING, first=(0, 0, 0), move=MOVE):
    scores, slots, costs, counts, shifts = data
    rows = scores.reshape(-1, 3 * LANES)
    # In reverse order, without views that are at the floor throughout.
    where = np.arange(len(rows), dtype=np.int32)[::-1].reshape(scores.shape[:2]).copy()
    where[(scores == FLOOR).all(axis=(2, 3))] = -1
    path = np.full((len(slots), 5), -1, np.int64)
    path[-1] = last
    ranges = np.tile([*first, *SHAPE, LANES], (len(shifts), 1))
    moving = NEAR, TURN, np.int64(move)
    trace(rows[::-1].copy(), where, slots, costs, counts, shifts, ranges, *moving, known, path)
    return path


def score(data, path, frame):
    """Return what the transition from a frame to the next one is worth."""
    ring, slots, costs, _, shifts = data
    before, after = path[frame], path[frame + 1]
    step = (after[1] - before[1]) % 3
    turn = 0 if before[0] == after[0] else TURN[after[0], 0]
    moved = np.abs(before[2:] - after[2:] - shifts[slots[frame + 1]])
    if step > 1 or moved.max() > 1:
        return -(10**6)
    worth = ring[slots[frame], before[0], before[1], lane(before)]
    return int(worth) - costs[slots[frame + 1], step] - turn - MOVE * moved.sum()


@pytest.mark.parametrize('seed', range(5))
def test_every_step_back_is_the_best_of_all(seed):
    data = clip(seed)
    data[4][data[1][3]] = 0, 1, -1
    data[0][data[1][2], seed % 2] = FLOOR
    path = traced(data, (1, 2, 0, 0, 2))
    for frame in range(4):
        states = itertools.product(range(2), range(3), range(2), range(2), range(3))
        other, best = path.copy(), -(10**6)
        for state in states:
            other[frame] = state
            best = max(best, score(data, other, frame))
        assert score(data, path, frame) == best


def test_a_path_that_meets_a_known_one_goes_on_with_it():
    data = clip(0)
    path = traced(data, (1, 2, 0, 0, 2))
    known = path[:3].copy()
    known[0] = 7
    assert traced(data, path[-1], known)[0].tolist() == [7] * 5
    known[:] = 7
    np.testing.assert_array_equal(traced(data, path[-1], known), path)
    known = path.copy()
    known[0] = 7
    np.testing.assert_array_equal(traced(data, path[-1], known), known)


@pytest.mark.parametrize(
    ('jump', 'nearest'),
    [
        ((0, 9, 0), [1, 1, 2]),
        ((0, -9, 0), [1, 0, 2]),
        ((9, 0, 0), [1, 0, 2]),
        ((-9, 0, -1), [0, 0, 1]),
        ((0, 0, 9), [1, 0, 2]),
        ((0, 0, -9), [1, 0, 0]),
    ],
)
@pytest.mark.parametrize('step', [0, 1])
def test_the_nearest_placement_takes_over_where_the_box_jumped_away(jump, nearest, step):
    data = clip(1, frames=2)
    data[4][data[1][1]] = jump
    data[2][data[1][1]] = 30
    data[2][data[1][1], step] = 20
    path = traced(data, (0, 1, 1, 0, 2))
    assert path[0].tolist() == [0, 1 - step, *nearest]


def test_who_might_as_well_have_stayed_has_stayed():
    data = clip(0)
    data[0][:], data[2][:] = 100, 0
    path = traced(data, (1, 2, 1, 0, 1), move=0)
    np.testing.assert_array_equal(path, np.tile([1, 2, 1, 0, 1], (5, 1)))


def test_states_are_counted_from_the_first_placement_there_is():
    data, first = clip(2), np.array([1, 3, 2])
    path = traced(data, (1, 2, 0, 0, 2))
    moved = traced(data, (1, 2, 1, 3, 4), first=first)
    np.testing.assert_array_equal(moved[:, :2], path[:, :2])
    np.testing.assert_array_equal(moved[:, 2:], path[:, 2:] + first)
