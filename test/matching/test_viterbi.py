# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from gait_segmentation.matching.scores import FLOOR
from gait_segmentation.matching.transitions import UNIT
from gait_segmentation.matching.viterbi import advance, shifted

SHAPE = (2, 2, 3)
USED, LANES = 12, 15
"""The filling is shorter than a body height: the next phase must not be taken for one more."""


def similarities(rng, rows, least=-100):
    return rng.integers(least, UNIT, (rows, LANES)).astype(np.int16)


def places():
    return list(itertools.product(*(range(n) for n in SHAPE)))


def lane(place):
    return (place[0] * SHAPE[1] + place[1]) * SHAPE[2] + place[2]


def run(
    before,
    best,
    gain,
    costs,
    near,
    near_cost,
    row,
    active=(True,) * 3,
    was_active=None,
):
    """Take in a frame; ``before`` is (V, P, N), or (0, P, N) if there was none."""
    rows = np.full((6, 3 * LANES + 4), FLOOR, np.int16)
    rows[: len(before), : 3 * LANES] = before.reshape(len(before), 3 * LANES)
    leading = np.zeros((3, 3), np.int16)
    was_active = np.array(active if was_active is None else was_active) & (len(before) > 0)
    place = np.arange(3, dtype=np.int32)
    sources = np.where(was_active, place, -1), np.where(active, place + 3, -1)
    reach = np.int16(32768 * 0.9), costs, near, near_cost
    advance(rows, *sources, np.int16(best), *reach, np.int16(20), SHAPE, gain, row, leading)
    return rows[3:, : 3 * LANES].reshape(3, 3, LANES), leading


def reached(scores, view, phase, place, costs, near, near_cost):
    """Return the best predecessor's score less the cost of the transition, by trying all."""
    others = [(view, 0)]
    others += [(v, c) for v, c in zip(near[view], near_cost[view], strict=True) if v >= 0]
    return max(
        int(scores[v, (phase - step) % 3, lane(p)])
        - int(costs[step])
        - int(turn)
        - 20 * sum(abs(a - b) for a, b in zip(p, place, strict=True))
        for v, turn in others
        for step in range(len(costs))
        for p in places()
        if max(abs(a - b) for a, b in zip(p, place, strict=True)) <= 1
    )


NEAR = {
    'none': np.full((3, 0), -1, np.int32),
    'one': np.array([[1], [0], [-1]], np.int32),
    'two': np.array([[1, 2], [0, -1], [1, 0]], np.int32),
    'three': np.array([[1, 2, 1], [0, -1, 2], [1, 0, 0]], np.int32),
}


# The least that the largest cost of a body height leaves of a similarity.
@pytest.mark.parametrize('least', [-100, -5400])
@pytest.mark.parametrize('costs', [[7], [30, 0], [30, 0, 25, 60], [UNIT, UNIT]])
@pytest.mark.parametrize('name', NEAR)
def test_equals_brute_force(name, costs, least):
    rng = np.random.default_rng(0)
    near, costs = NEAR[name], np.array(costs, np.int16)
    near_cost = rng.integers(50, 100, near.shape).astype(np.int16)
    row = np.array([0, 1, 2, 3, 4, 0, 2, 1, 0], np.int32)
    scores, best = np.zeros((0, 3, LANES), np.int16), 0
    for number in range(4):
        gain = similarities(rng, 5, least)
        if least < -100 and number == 1:
            # One alone leads, all others fall to the floor.
            scores[...] = FLOOR + least
            scores[0, 0, 0] = best
        after, leading = run(scores, best, gain, costs, near, near_cost, row)
        for view, phase, place in itertools.product(range(3), range(3), places()):
            own = int(gain[row[view * 3 + phase], lane(place)])
            if number:
                came = reached(scores, view, phase, place, costs, near, near_cost)
                own += max(came - best, FLOOR) * int(32768 * 0.9) >> 15
            assert after[view, phase, lane(place)] == own
            assert leading[view, phase] >= own
        assert leading.max() == max(after[..., lane(p)].max() for p in places())
        assert (after[..., USED:] == FLOOR).all()
        scores, best = after, int(leading.max())


def test_scores_at_the_floor_and_walls_do_not_wrap_around():
    scores = np.full((3, 3, LANES), FLOOR, np.int16)
    scores[0, 0, 0] = UNIT
    costs = np.array([UNIT, UNIT], np.int16)
    near, near_cost = NEAR['two'], np.full((3, 2), UNIT, np.int16)
    gain = np.zeros((9, LANES), np.int16)
    row = np.arange(9, dtype=np.int32)
    after, leading = run(scores, UNIT, gain, costs, near, near_cost, row)
    assert leading.max() == -UNIT * int(32768 * 0.9) >> 15
    assert after.min() == FLOOR
    used = [lane(place) for place in places()]
    assert after[2, 2, used].max() == FLOOR * int(32768 * 0.9) >> 15


def test_views_that_are_not_searched_are_left_alone_and_lead_nowhere():
    rng = np.random.default_rng(1)
    gain, row = similarities(rng, 9), np.arange(9, dtype=np.int32)
    near, near_cost = NEAR['two'], np.zeros((3, 2), np.int16)
    scores = rng.integers(0, 100, (3, 3, LANES)).astype(np.int16)
    rest = near, near_cost, row
    active, was_active = (True, True, False), (False, True, True)
    after, leading = run(scores, 99, gain, np.zeros(1, np.int16), *rest, active, was_active)
    assert (after[2] == FLOOR).all()
    assert (leading[2] == FLOOR).all()
    scores[0] = FLOOR
    lead, _ = run(scores, 99, gain, np.zeros(1, np.int16), *rest, active)
    np.testing.assert_array_equal(after[1], lead[1])


@pytest.mark.parametrize('shape', [SHAPE, (1, 3, 2)])
def test_a_jump_moves_scores_and_opens_the_border(shape):
    lanes = LANES, 8 if shape != SHAPE else LANES
    before, after = np.array([-1, 2]), np.array([-1, 3])
    for shift in itertools.product((-1, 0, 1), (-2, -1, 0, 1), (-3, -1, 0, 2)):
        rows = np.zeros((4, 2 * LANES), np.int16)
        rows[2] = np.arange(1, 2 * LANES + 1)
        shifted(rows, before, after, 2, SHAPE, shape, lanes, np.array(shift))
        for phase, place in itertools.product(range(2), itertools.product(*map(range, shape))):
            come = tuple(np.add(place, shift).tolist())
            here = phase * lanes[1] + (place[0] * shape[1] + place[1]) * shape[2] + place[2]
            expected = rows[2, phase * LANES + lane(come)] if come in places() else FLOOR
            assert rows[3, here] == expected, shift
        assert not rows[:2].any()
