# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.phase_filter import PhaseFilter

PHASES, FPS = 30, 25


def seen(phase, contrast, rng):
    # Neighbouring phases look alike, and so do their errors.
    at = 2 * np.pi * np.arange(PHASES) / PHASES
    a, b, c, d = rng.normal(0, 12.0, 4)
    errors = a * np.cos(at) + b * np.sin(at) + c * np.cos(2 * at) + d * np.sin(2 * at)
    # A factor of e is worth less where errors are as large as these.
    return 0.6 * (contrast * np.cos(at - 2 * np.pi * phase) + errors)


def take_in(clock, evidence, seconds, moved=0):
    clock.predict(seconds, moved)
    clock.correct(evidence)


def run(clock, phases, contrast):
    rng = np.random.default_rng(0)
    filtered = []
    for number, phase in enumerate(phases):
        take_in(clock, seen(phase, contrast, rng), number / FPS)
        filtered.append(clock.belief())
    return np.array(filtered)


def off(beliefs, phases):
    mean = np.angle(beliefs @ np.exp(2j * np.pi * np.arange(PHASES) / PHASES)) / (2 * np.pi)
    return np.abs((mean - phases + 0.5) % 1 - 0.5)


@pytest.mark.parametrize('rate', [0.7, 1.1])
def test_evidence_too_weak_for_a_frame_adds_up_along_a_walk(rate):
    phases = 0.3 + rate * np.arange(100) / FPS
    clock = PhaseFilter(PHASES, 0.5, 1.33, 1, np.ones((1, 1, 1)))
    beliefs = run(clock, phases, 15.0)
    rng = np.random.default_rng(0)
    alone = [seen(phase, 15.0, rng).argmax() / PHASES for phase in phases]
    assert np.abs((alone - phases + 0.5) % 1 - 0.5).mean() > 0.12
    assert off(beliefs, phases)[50:].mean() < 0.05
    assert clock.rate == pytest.approx(rate, rel=0.1)
    assert beliefs.sum(axis=1) == pytest.approx(1)


def test_somebody_who_stops_stands():
    phases = np.concatenate([np.arange(50) / FPS, np.full(40, 2.0)])
    clock = PhaseFilter(PHASES, 0.5, 1.33, 1, np.ones((1, 1, 1)))
    beliefs = run(clock, phases, 60.0)
    assert clock.rate < 0.1
    assert off(beliefs, phases)[-20:].mean() < 0.03


def test_later_frames_correct_earlier_ones():
    phases = 0.1 + 0.9 * np.arange(60) / FPS
    clock = PhaseFilter(PHASES, 0.5, 1.33, 60, np.ones((1, 1, 1)))
    filtered = run(clock, phases, 15.0)
    later = np.array([clock.belief(back) for back in reversed(range(60))])
    assert later[-1] == pytest.approx(filtered[-1])
    assert off(later, phases).mean() < 0.9 * off(filtered, phases).mean()


def test_half_strides_that_look_alike_stay_equally_likely():
    clock = PhaseFilter(PHASES, 0.5, 1.33, 1, np.ones((1, 1, 1)))
    at = np.arange(PHASES) / PHASES
    for number in range(50):
        take_in(clock, 100 * np.cos(4 * np.pi * (at - 0.04 * number)), number / FPS)
    belief = clock.belief()
    assert belief[:15] == pytest.approx(belief[15:], abs=1e-6)
    assert clock.rate == pytest.approx(1.0, abs=0.1)


def across(phase, view, views, rng):
    """Evidence of all views, of which the wrong ones are sure of another phase."""
    wrong = [seen(phase + 0.3, 60.0, rng) - 25.0 * abs(view - other) for other in range(views)]
    wrong[view] = seen(phase, 60.0, rng)
    return np.array(wrong)


def test_the_view_is_found_with_the_phase_and_the_others_are_not_looked_at_any_more():
    rng = np.random.default_rng(1)
    phases = 0.2 + 0.9 * np.arange(40) / FPS
    clock = PhaseFilter(PHASES, 0.5, 1.33, 1, np.ones((5, 1, 1)))
    assert clock.predict(0.0).all()
    found = []
    for number, phase in enumerate(phases):
        evidence = across(phase, 1, 5, rng)
        evidence[~clock.predict(number / FPS).ravel()] = -np.inf
        take_in(clock, evidence, number / FPS)
        found.append(clock.belief())
    assert off(np.array(found), phases)[10:].mean() < 0.03
    likely = clock.predict(40 / FPS)
    assert likely[1]
    assert not likely[4]


def test_views_move_on_with_somebody_who_turns():
    rng = np.random.default_rng(2)
    phases = 0.2 + 0.9 * np.arange(60) / FPS
    found = {}
    for told in (True, False):
        clock = PhaseFilter(PHASES, 0.5, 1.33, 60, np.ones((5, 1, 1)))
        for number, phase in enumerate(phases):
            view = 3 if number < 20 else 1
            moved = 2 if told and number == 20 else 0
            take_in(clock, across(phase, view, 5, rng), number / FPS, moved)
            if number == 20:
                found[told] = clock.predict((number + 1) / FPS)[1]
        smoothed = np.array([clock.belief(back) for back in reversed(range(60))])
        assert off(smoothed, phases).mean() < 0.03
    assert found[True]


def test_one_frame_rules_no_phase_out():
    clock = PhaseFilter(PHASES, 0.5, 1.33, 1, np.ones((1, 1, 1)))
    evidence = np.zeros(PHASES)
    evidence[6] = 1e4
    take_in(clock, evidence, 0.0)
    belief = clock.belief()
    assert belief.argmax() == 6
    assert belief.min() == pytest.approx(np.exp(-12.0), rel=0.01)


def test_the_past_is_seen_from_the_views_of_then():
    clock = PhaseFilter(PHASES, 0.5, 1.33, 2, np.ones((3, 1, 1)))
    first, second = np.full((2, 3, PHASES), -1e3)
    first[1, 0] = first[2, 15] = 0.0
    second[1] = 0.0
    take_in(clock, first, 0.0)
    assert clock.belief()[[0, 15]] == pytest.approx([0.5, 0.5], abs=0.01)
    # The second view is now what was the third.
    take_in(clock, second, 0.05, 1)
    before = clock.belief(1)
    assert before[15] > 3 * before[0]
