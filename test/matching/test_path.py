# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.path import PathSearch
from gait_segmentation.matching.scores import FLOOR
from gait_segmentation.matching.search_range import SearchRange
from gait_segmentation.matching.tanimoto import pitch_of
from gait_segmentation.matching.transitions import UNIT

PHASES = 12
ONE = SearchRange((0, 0, 0), (1, 1, 1))


def search(**parameters):
    bank = TemplateBank(
        np.zeros((1, PHASES, 4, 4), np.uint8), np.zeros(1, np.float32), ('a',), 0.9
    )
    row = np.arange(PHASES, dtype=np.int32)
    config = MatchingConfig(**parameters)
    return PathSearch(bank, row, ONE.shape, config)


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
        path.step(seen(noisy), k / 30, (0, 0, 0), ONE)
        found = path.follow()
    assert found.rate == pytest.approx(1.0, abs=0.06)
    assert (np.diff(found.states[:, 1]) % PHASES <= 1).all()
    assert found.seconds[-1] - found.seconds[0] == pytest.approx(59 / 30, abs=0.2)


def test_stays_with_one_of_two_twins():
    path = search()
    rng = np.random.default_rng(1)
    phases = []
    for k in range(300):
        path.step(seen(bump(0.4 * k, rng.normal(0, 0.02)) / 2), k / 30, (0, 0, 0), ONE)
        phases.append(int(path.follow().states[-1, 1]))
    steps = np.diff(phases) % PHASES
    assert (steps <= 2).all()


def test_leaves_a_twin_that_is_clearly_worse():
    path = search()
    for k in range(200):
        better = 0.0 if k < 60 else -0.3
        path.step(seen(bump(0.4 * k, better) / 2), k / 30, (0, 0, 0), ONE)
        state = path.follow().states[-1, 1]
    assert abs((state - 0.4 * 199 + 6) % 12 - 6) <= 1


def test_following_the_path_again_finds_the_same():
    path = search()
    for k in range(4):
        path.step(seen(bump(4 * k) / 2), 0.35 * k, (0, 0, 0), ONE)
        before, found = path.leader(), path.follow()
        np.testing.assert_array_equal(path.follow().states, found.states)
        assert path.leader() == before


def test_what_is_not_searched_is_at_the_floor_in_whichever_slot():
    bank = TemplateBank(
        np.zeros((2, PHASES, 4, 4), np.uint8), np.zeros(2, np.float32), ('a', 'b'), 0.9
    )
    row = np.arange(2 * PHASES, dtype=np.int32)
    path = PathSearch(bank, row, (2, 1, 2), MatchingConfig(window=0.2))
    rng = np.random.default_rng(3)
    for k in range(200):
        similarity = rng.integers(0, UNIT, (2 * PHASES, pitch_of(4))).astype(np.int16)
        active = np.array([True, False]) if k // 20 % 2 else np.array([k % 40 < 30, True])
        searched = SearchRange((k // 7 % 2, 0, k // 11 % 3), (2, 1, 2 - k // 50 % 2))
        path.step(similarity, k / 30, (0, 0, 0), searched, active)
        found = path.scores(0)
        np.testing.assert_array_equal(found.where >= 0, active)
        for view, scale, column in itertools.product((0, 1), range(4), range(6)):
            here = scale in range(4)[searched.heights] and column in range(6)[searched.columns]
            score = found.at(view, k % PHASES, (scale, 0, column))
            assert (score > FLOOR) == (here and active[view])


def test_keeps_of_each_frame_what_was_searched_in_it():
    bank = TemplateBank(
        np.zeros((2, PHASES, 4, 4), np.uint8), np.zeros(2, np.float32), ('a', 'b'), 0.9
    )
    row = np.arange(2 * PHASES, dtype=np.int32)
    path = PathSearch(bank, row, ONE.shape, MatchingConfig(lag=5, window=0.2))
    size = len(path._trellis.rows)
    assert size < 2 * path._trellis.capacity
    noise = np.zeros((2 * PHASES, pitch_of(1)), np.int16)
    for round in range(3):
        path.reset()
        for k in range(40):
            jump = (0, 0, k % 2)
            active = np.array([k == 0 or round != 1, k == 0 or round == 1])
            path.step(noise, k / 30, jump, ONE, active)
            assert path._trellis.used == path.frames + (path.frames == k + 1)
    assert len(path._trellis.rows) == size


def test_is_bounded_over_many_frames():
    path = search(window=0.3)
    rng = np.random.default_rng(2)
    noise = [seen(rng.random(PHASES)) for _ in range(50)]
    for k in range(3_000):
        path.step(noise[k % 50], k / 30, (0, 0, 0), ONE)
    assert path.frames <= 12
    assert path.scores(0).of(0, 0).min() >= FLOOR
    assert abs(int(path.leading.max())) < 2 * 2048
    assert path.follow().states.shape == (path.frames, 5)


def test_only_a_path_of_half_a_second_is_believed_to_have_a_rate_and_only_a_possible_one():
    path = search(minimum_cadence=60.0)
    nominal = path._rate
    for k in range(40):
        path.step(seen(bump(0) / 2), k / 30, (0, 0, 0), ONE)
        path.follow()
        # Who stands would have none.
        assert path._rate == pytest.approx(nominal if k < 15 else 0.5)
    path.reset()
    assert path._rate == nominal


def test_a_path_that_slides_is_the_one_traced_through_all_its_frames():
    path = search(window=0.5)
    for k in range(90):
        phase = 0.4 * max(k % 45 - 20, 0)
        path.step(seen(bump(phase) / 2), k / 30, (0, 0, 0), ONE)
        found = path.follow().states
        path._traced = np.empty((0, 5), np.int64)
        np.testing.assert_array_equal(path.follow().states, found)


@pytest.mark.parametrize('memory', [0.2, 2.0])
def test_scores_fade(memory):
    path = search(memory=memory)
    first = np.full(PHASES, 0.3)
    first[3] = 0.8
    path.step(seen(first), 0.0, (0, 0, 0), ONE)
    path.step(seen(np.zeros(PHASES)), 0.04, (0, 0, 0), ONE)
    spread = int(path.leading.max()) - int(path.leading[0, 9])
    stay = UNIT * 0.5 * np.exp(-0.04 / memory)
    assert spread == pytest.approx(stay, rel=0.02)


def test_a_box_that_jumps_leaves_the_body_where_it_is():
    bank = TemplateBank(
        np.zeros((1, PHASES, 4, 4), np.uint8), np.zeros(1, np.float32), ('a',), 0.9
    )
    wide = SearchRange((0, 0, 0), (1, 1, 7))
    path = PathSearch(bank, np.arange(PHASES, dtype=np.int32), wide.shape, MatchingConfig())
    values = np.zeros((PHASES, pitch_of(7)), np.int16)
    values[2, 5] = UNIT
    path.step(values, 0.0, (0, 0, 0), wide)
    path.follow()
    path.step(np.zeros_like(values), 0.04, (0, 0, 3), wide)
    assert path.leader()[2:] == (0, 0, 2)
    assert path.follow().states[:, 4].tolist() == [5, 2]


def turning(seconds, followed, other, view=1):
    """Return what leads after a step if two templates are nearly as good."""
    bank = TemplateBank(
        np.zeros((2, PHASES, 4, 4), np.uint8), np.float32([0.0, 0.3]), ('a', 'a'), 0.9
    )
    row = np.arange(2 * PHASES, dtype=np.int32)
    path = PathSearch(bank, row, ONE.shape, MatchingConfig())
    values = np.zeros((2 * PHASES, pitch_of(1)), np.int16)
    values[followed, 0] = UNIT
    path.step(values, 0.0, (0, 0, 0), ONE)
    path.follow()
    path.step(values, seconds, (0, 0, 0), ONE)
    path.leading[:] = 0
    path.leading[view, other], path.leading[0, (other + 6) % PHASES] = 1000, 1001
    return path._leading_template()


def test_a_neighbouring_view_in_time_is_preferred_to_a_twin():
    assert turning(0.04, 4, 4) == (1, 4)


def test_a_path_is_expected_where_its_rate_leads():
    rate = MatchingConfig().middle_rate
    ahead = round(PHASES * rate * 0.35)
    assert ahead >= 3
    assert turning(0.35, 2, 2 + ahead, view=0) == (0, 2 + ahead)
