# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import copy
import itertools
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.common_areas import UNIT
from gait_segmentation.matching.path import (
    FLOOR,
    PathSearch,
    Views,
    advance,
    shifted,
    step_back,
    view_changes,
)
from gait_segmentation.matching.placements import SearchRange

PHASES = 12
ONE = SearchRange((0, 0, 0), (1, 1, 1))


def search(**parameters):
    bank = TemplateBank(
        np.zeros((1, PHASES, 4, 4), np.uint8), np.zeros(1, np.float32), ('a',), 0.9
    )
    row = np.arange(PHASES, dtype=np.int32)
    config = MatchingConfig(**parameters)
    return PathSearch(bank, row, config)


def seen(similarities):
    values = np.zeros((PHASES, ONE.pitch), np.int16)
    values[:, 0] = np.round(UNIT * np.asarray(similarities))
    return values


def bump(phase, twin=0.0):
    away = (np.arange(PHASES) - phase + PHASES / 2) % PHASES - PHASES / 2
    other = (np.arange(PHASES) - phase) % PHASES - PHASES / 2
    return 0.3 + 0.5 * np.exp(-(away**2)) + (0.5 + twin) * np.exp(-(other**2))


def test_measures_the_cadence_and_never_goes_back():
    path = search(window=1.5)
    rng = np.random.default_rng(0)
    for k in range(90):
        noisy = np.clip(bump(0.4 * k) / 2 + rng.normal(0, 0.1, PHASES), 0, 1)
        path.step(seen(noisy), k / 30, ONE)
        found = path.follow()
        # What was traced before is only a short cut.
        again = copy.copy(path)
        again._traced = found[:0]
        np.testing.assert_array_equal(again.follow(), found)
    assert path.rate == pytest.approx(1.0, abs=0.06)
    assert (np.diff(found[:, 1]) % PHASES <= 1).all()
    assert len(found) / 30 == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize('cadence', [75.0, 110.0, 146.0])
def test_without_evidence_it_goes_at_the_expected_rate(cadence):
    # 0.25 to 0.5 phases a frame: no whole number of them.
    path = search(minimum_cadence=cadence - 1, maximum_cadence=cadence + 1, rate_cost=4.0)
    for k in range(31):
        path.step(seen(np.full(PHASES, 0.5)), k / 30, ONE)
    phases = path.follow()[:, 1]
    assert abs((np.diff(phases) % PHASES).sum() - PHASES * cadence / 120) <= 1


def test_twins_of_which_now_one_is_better_and_now_the_other_do_not_alternate():
    path, states = search(), []
    for k in range(60):
        path.step(seen(bump(0.4 * k, 0.1 * (-1) ** k) / 2), k / 30, ONE)
        states.append(path.follow()[-1, 1])
    assert (np.diff(states) % PHASES <= 2).all()


def test_leaves_a_twin_that_is_clearly_worse():
    path = search()
    for k in range(200):
        better = 0.0 if k < 60 else -0.3
        path.step(seen(bump(0.4 * k, better) / 2), k / 30, ONE)
        state = path.follow()[-1, 1]
    assert abs((state - 0.4 * 199 + 6) % 12 - 6) <= 1


def test_only_a_path_of_half_a_second_is_believed_to_have_a_rate_and_only_a_possible_one():
    path = search(minimum_cadence=60.0)
    nominal = path.rate
    for k in range(40):
        path.step(seen(bump(0) / 2), k / 30, ONE)
        path.follow()
        # Who stands would have none.
        assert path.rate == pytest.approx(nominal if k < 15 else 0.5)


@pytest.mark.parametrize('memory', [0.2, 2.0])
def test_scores_fade(memory):
    path = search(memory=memory)
    first = np.full(PHASES, 0.3)
    first[3] = 0.8
    path.step(seen(first), 0.0, ONE)
    path.step(seen(np.zeros(PHASES)), 0.04, ONE)
    spread = int(path.leading.max()) - int(path.leading[0, 9])
    stay = UNIT * 0.5 * np.exp(-0.04 / memory)
    assert spread == pytest.approx(stay, rel=0.02)


def test_turns_to_neighbours_and_changes_build_in_place():
    azimuth = np.array([0, math.pi / 2, math.pi, -math.pi / 2, 0], np.float32)
    bank = TemplateBank(np.zeros((5, 2, 4, 4), np.uint8), azimuth, ('a', 'a', 'a', 'a', 'b'), 0.9)
    near, cost = view_changes(bank, MatchingConfig(view_cost=0.1, build_cost=0.2))
    found = [
        {int(v): int(c) for v, c in zip(*row, strict=True) if v >= 0}
        for row in zip(near, cost, strict=True)
    ]
    turn, change = round(0.1 * UNIT), round(0.2 * UNIT)
    assert found[0] == {1: turn, 3: turn, 4: change}
    assert found[2] == {1: turn, 3: turn}
    assert found[4] == {0: change}


@pytest.mark.parametrize(('degrees', 'between'), [(45, 0.3), (90, 0.0)])
def test_there_is_nothing_between_views_that_are_far_apart(degrees, between):
    azimuth = np.radians(np.arange(0, 360, degrees)).astype(np.float32)
    templates = np.zeros((len(azimuth), 2, 4, 4), np.uint8)
    bank = TemplateBank(templates, azimuth, ('a',) * len(azimuth), 0.9)
    assert Views(bank).azimuth(0, 0.3) == pytest.approx(between * math.radians(degrees))


# Steps of the search.
SHAPE = (2, 2, 3)
USED, LANES = 12, 15
"""The filling is shorter than a body height: the next phase must not be taken for one more."""


def similarities(rng, rows, least=-100):
    return rng.integers(least, UNIT, (rows, LANES)).astype(np.int16)


def places():
    return list(itertools.product(*(range(n) for n in SHAPE)))


def lane(place):
    return (place[0] * SHAPE[1] + place[1]) * SHAPE[2] + place[2]


def run(before, best, gain, costs, near, near_cost, row):
    """Take in a frame; ``before`` is (V, P, N), or (0, P, N) if there was none."""
    new, leading = np.empty((3, 3 * LANES), np.int16), np.zeros((3, 3), np.int16)
    old = np.ascontiguousarray(before).reshape(len(before), 3 * LANES)
    reach = np.int16(32768 * 0.9), costs, near, near_cost
    advance(old, new, np.int16(best), *reach, np.int16(20), SHAPE, gain, row, leading)
    return new.reshape(3, 3, LANES), leading


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


@pytest.mark.parametrize('shape', [SHAPE, (1, 3, 2)])
def test_another_range_moves_scores_and_opens_the_border(shape):
    lanes = LANES, 8 if shape != SHAPE else LANES
    for shift in itertools.product((-1, 0, 1), (-2, -1, 0, 1), (-3, -1, 0, 2)):
        before = np.arange(1, 2 * LANES + 1, dtype=np.int16)[None]
        after = np.zeros((1, 2 * LANES), np.int16)
        shifted(before, after, 2, SHAPE, shape, lanes, np.array(shift))
        for phase, place in itertools.product(range(2), itertools.product(*map(range, shape))):
            come = tuple(np.add(place, shift).tolist())
            here = phase * lanes[1] + (place[0] * shape[1] + place[1]) * shape[2] + place[2]
            expected = before[0, phase * LANES + lane(come)] if come in places() else FLOOR
            assert after[0, here] == expected, shift


MOVE = 20
BESIDE, TURN = np.array([[1], [0]], np.int32), np.array([[70], [90]], np.int16)


def clip(seed, frames=5, slots=7):
    rng = np.random.default_rng(seed)
    ring = rng.integers(-500, 500, (slots, 2, 3, LANES)).astype(np.int16)
    costs = rng.integers(0, 60, (slots, 3)).astype(np.int16)
    return ring, rng.permutation(slots)[:frames], costs, np.full(slots, 2)


def traced(data, last, first=(0, 0, 0), move=MOVE):
    """Trace a path back frame by frame."""
    scores, slots, costs, counts = data
    path = np.full((len(slots), 5), -1, np.int64)
    path[-1] = last
    for frame in range(len(slots) - 1, 0, -1):
        here, before = slots[frame], scores[slots[frame - 1]].reshape(2, 3 * LANES)
        step = costs[here, : counts[here]], tuple(map(int, first)), SHAPE, LANES, 3
        step_back(before, *step, BESIDE, TURN, move, path[frame], path[frame - 1])
    return path


def score(data, path, frame):
    """Return what the transition from a frame to the next one is worth."""
    ring, slots, costs, _ = data
    before, after = path[frame], path[frame + 1]
    step = (after[1] - before[1]) % 3
    turn = 0 if before[0] == after[0] else TURN[after[0], 0]
    moved = np.abs(before[2:] - after[2:])
    if step > 1 or moved.max() > 1:
        return -(10**6)
    worth = ring[slots[frame], before[0], before[1], lane(before[2:])]
    return int(worth) - costs[slots[frame + 1], step] - turn - MOVE * moved.sum()


@pytest.mark.parametrize('seed', range(5))
def test_every_step_back_is_the_best_of_all(seed):
    data = clip(seed)
    data[0][data[1][2], seed % 2] = FLOOR
    path = traced(data, (1, 2, 0, 0, 2))
    for frame in range(4):
        states = itertools.product(range(2), range(3), range(2), range(2), range(3))
        other, best = path.copy(), -(10**6)
        for state in states:
            other[frame] = state
            best = max(best, score(data, other, frame))
        assert score(data, path, frame) == best


@pytest.mark.parametrize(
    ('away', 'nearest'),
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
def test_the_nearest_placement_takes_over_where_nothing_was_searched(away, nearest, step):
    data = clip(1, frames=2)
    data[2][data[1][1]] = 30
    data[2][data[1][1], step] = 20
    path = traced(data, (0, 1, 1 + away[0], away[1], 2 + away[2]))
    assert path[0].tolist() == [0, 1 - step, *nearest]
