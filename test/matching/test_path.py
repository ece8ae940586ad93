# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import copy
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.common_areas import UNIT
from gait_segmentation.matching.path import PathSearch, Views, view_changes
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
