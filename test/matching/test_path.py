# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.common_areas import pitch_of
from gait_segmentation.matching.path import (
    UNIT,
    PathSearch,
    Scores,
    phase_costs,
    view_changes,
)
from gait_segmentation.matching.placements import SearchRange
from gait_segmentation.matching.viterbi import FLOOR

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
    values = np.zeros((PHASES, pitch_of(1)), np.int16)
    values[:, 0] = np.round(UNIT * np.asarray(similarities))
    return values


def bump(phase, twin=0.0):
    away = (np.arange(PHASES) - phase + PHASES / 2) % PHASES - PHASES / 2
    other = (np.arange(PHASES) - phase) % PHASES - PHASES / 2
    return 0.3 + 0.5 * np.exp(-(away**2)) + (0.5 + twin) * np.exp(-(other**2))


def test_measures_the_cadence_and_never_goes_back():
    path = search(window=2.0)
    rng = np.random.default_rng(0)
    for k in range(60):
        noisy = np.clip(bump(0.4 * k) / 2 + rng.normal(0, 0.1, PHASES), 0, 1)
        path.step(seen(noisy), k / 30, ONE)
        found = path.follow()
    assert path.rate == pytest.approx(1.0, abs=0.06)
    assert (np.diff(found[:, 1]) % PHASES <= 1).all()
    assert len(found) / 30 == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize('cadence', [75.0, 110.0, 146.0])
def test_without_evidence_it_goes_at_the_expected_rate(cadence):
    # 0.25 to 0.5 phases a frame: no whole number of them.
    path = search(minimum_cadence=cadence - 1, maximum_cadence=cadence + 1, rate_cost=4.0)
    for k in range(31):
        path.step(seen(np.full(PHASES, 0.5)), k / 30, ONE)
    phases = path.follow()[:, 1]
    assert abs((np.diff(phases) % PHASES).sum() - PHASES * cadence / 120) <= 1


def test_stays_with_one_of_two_twins():
    path = search()
    rng = np.random.default_rng(1)
    phases = []
    for k in range(300):
        path.step(seen(bump(0.4 * k, rng.normal(0, 0.02)) / 2), k / 30, ONE)
        phases.append(int(path.follow()[-1, 1]))
    steps = np.diff(phases) % PHASES
    assert (steps <= 2).all()


def test_leaves_a_twin_that_is_clearly_worse():
    path = search()
    for k in range(200):
        better = 0.0 if k < 60 else -0.3
        path.step(seen(bump(0.4 * k, better) / 2), k / 30, ONE)
        state = path.follow()[-1, 1]
    assert abs((state - 0.4 * 199 + 6) % 12 - 6) <= 1


def test_what_is_not_searched_is_at_the_floor():
    path = search(window=0.2)
    rng = np.random.default_rng(3)
    for k in range(200):
        similarity = rng.integers(0, UNIT, (PHASES, pitch_of(4))).astype(np.int16)
        searched = SearchRange((k // 7 % 2, 0, k // 11 % 3), (2, 1, 2 - k // 50 % 2))
        path.step(similarity, k / 30, searched)
        found = path.scores(0)
        for scale, column in itertools.product(range(4), range(6)):
            here = scale in range(4)[searched.heights] and column in range(6)[searched.columns]
            assert (found.at(0, k % PHASES, (scale, 0, column)) > FLOOR) == here


def test_is_bounded_over_many_frames():
    path = search(window=0.3)
    rng = np.random.default_rng(2)
    noise = [seen(rng.random(PHASES)) for _ in range(50)]
    for k in range(3_000):
        path.step(noise[k % 50], k / 30, ONE)
    assert path.frames <= 12
    assert path.scores(0).of(0, 0).min() >= FLOOR
    assert abs(int(path.leading.max())) < 2 * 2048
    assert path.follow().shape == (path.frames, 5)


def test_only_a_path_of_half_a_second_is_believed_to_have_a_rate_and_only_a_possible_one():
    path = search(minimum_cadence=60.0)
    nominal = path.rate
    for k in range(40):
        path.step(seen(bump(0) / 2), k / 30, ONE)
        path.follow()
        # Who stands would have none.
        assert path.rate == pytest.approx(nominal if k < 15 else 0.5)
    path.reset()
    assert path.rate == nominal


def test_a_path_that_slides_is_the_one_traced_through_all_its_frames():
    path = search(window=0.5)
    for k in range(90):
        phase = 0.4 * max(k % 45 - 20, 0)
        path.step(seen(bump(phase) / 2), k / 30, ONE)
        found = path.follow()
        path._traced = np.empty((0, 5), np.int64)
        np.testing.assert_array_equal(path.follow(), found)


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


def test_a_neighbouring_view_in_time_is_preferred_to_a_twin():
    templates, azimuths = np.zeros((2, PHASES, 4, 4), np.uint8), np.float32([0.0, 0.3])
    bank = TemplateBank(templates, azimuths, ('a', 'a'), 0.9)
    path = PathSearch(bank, np.arange(2 * PHASES, dtype=np.int32), MatchingConfig())
    values = np.zeros((2 * PHASES, pitch_of(1)), np.int16)
    values[4] = UNIT
    path.step(values, 0.0, ONE)
    path.follow()
    path.step(values, 0.04, ONE)
    path.leading[:] = 0
    path.leading[1, 4], path.leading[0, 10] = 1000, 1001
    assert path._leading_template() == (1, 4)


def test_steps_reach_from_standing_to_the_fastest_walk():
    costs = phase_costs(30, 1 / 30, 1, 4 / 3, 0.3)
    assert len(costs) == 3
    assert costs.argmin() == 1
    assert costs[0] == round(UNIT * 0.3 / 30)
    assert len(phase_costs(30, 0.5, 14, 4 / 3, 0.3)) == 21
    assert len(phase_costs(30, 9.0, 256, 4 / 3, 0.3)) == 30
    assert len(phase_costs(30, 1e-3, 0, 4 / 3, 0.3)) == 2


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


VIEWS, ROUND, SHAPE = 8, 6, (3, 5, 4)
LANES = pitch_of(60)
ALL = SearchRange((0, 0, 0), SHAPE)


def offsets(scores, state):
    """Return how far beside a state the best place lies; views go round."""
    return scores.offsets(state, ((state[0] - 1) % VIEWS, (state[0] + 1) % VIEWS), ROUND)


def scores(best):
    """Return a paraboloid about a place; view and phase go round."""
    result = np.zeros((VIEWS, ROUND, LANES), np.int16)
    for place in itertools.product(range(VIEWS), range(ROUND), *(range(n) for n in SHAPE)):
        off = np.array(place) - best
        off[0] = (off[0] + VIEWS / 2) % VIEWS - VIEWS / 2
        off[1] = (off[1] + ROUND / 2) % ROUND - ROUND / 2
        result[place[0], place[1], ALL.lane(*place[2:])] = round(
            5000 - 200 * float((off**2).sum())
        )
    return result


def kept(values, searched=ALL):
    return Scores(values.reshape(VIEWS, -1), searched)


def test_finds_the_vertex_along_each_axis():
    best = np.array([0.25, -0.375, 1.25, 2.5, 1.75])
    found = offsets(kept(scores(best)), (0, 0, 1, 2, 2))
    assert found == pytest.approx([0.25, -0.375, 0.25, 0.5, -0.25], abs=0.01)


def test_the_border_and_flat_scores_have_no_vertex():
    values = scores(np.array([0.25, 0.25, 0.25, 0.25, 0.25]))
    assert offsets(kept(values), (0, 0, 0, 0, 0))[2:] == [0.0, 0.0, 0.0]
    assert offsets(kept(np.zeros_like(values)), (0, 0, 1, 1, 1)) == [0.0] * 5
