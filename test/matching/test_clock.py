# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.clock import PhaseClock

PHASES, FPS = 30, 25


def seen(phase, contrast, rng, noise=12.0):
    # Neighbouring phases look alike, and so do their errors.
    at = 2 * np.pi * np.arange(PHASES) / PHASES
    a, b, c, d = rng.normal(0, noise, 4)
    errors = a * np.cos(at) + b * np.sin(at) + c * np.cos(2 * at) + d * np.sin(2 * at)
    return contrast * np.cos(at - 2 * np.pi * phase) + errors


def run(clock, phases, contrast, seed=0):
    rng = np.random.default_rng(seed)
    filtered = []
    for number, phase in enumerate(phases):
        clock.update(seen(phase, contrast, rng), number / FPS)
        filtered.append(clock.beliefs(1)[0])
    return np.array(filtered)


def off(beliefs, phases):
    mean = np.angle(beliefs @ np.exp(2j * np.pi * np.arange(PHASES) / PHASES)) / (2 * np.pi)
    return np.abs((mean - phases + 0.5) % 1 - 0.5)


@pytest.mark.parametrize('rate', [0.7, 1.1])
def test_evidence_too_weak_for_a_frame_adds_up_along_a_walk(rate):
    phases = 0.3 + rate * np.arange(100) / FPS
    clock = PhaseClock(PHASES, 0.5, 1.33, 1)
    beliefs = run(clock, phases, 15.0)
    rng = np.random.default_rng(0)
    alone = [seen(phase, 15.0, rng).argmax() / PHASES for phase in phases]
    assert np.abs((alone - phases + 0.5) % 1 - 0.5).mean() > 0.12
    assert off(beliefs, phases)[50:].mean() < 0.05
    assert clock.rate == pytest.approx(rate, rel=0.1)
    assert beliefs.sum(axis=1) == pytest.approx(1)


def test_somebody_who_stops_stands():
    phases = np.concatenate([np.arange(50) / FPS, np.full(40, 2.0)])
    clock = PhaseClock(PHASES, 0.5, 1.33, 1)
    beliefs = run(clock, phases, 60.0)
    assert clock.rate < 0.1
    assert off(beliefs, phases)[-20:].mean() < 0.03


def test_later_frames_correct_earlier_ones():
    phases = 0.1 + 0.9 * np.arange(60) / FPS
    clock = PhaseClock(PHASES, 0.5, 1.33, 60)
    filtered = run(clock, phases, 15.0)
    smoothed = clock.beliefs(60)
    assert smoothed[-1] == pytest.approx(filtered[-1])
    assert off(smoothed, phases).mean() < 0.9 * off(filtered, phases).mean()
    assert clock.beliefs(5) == pytest.approx(smoothed[-5:])


def test_smoothing_is_bayes_rule():
    # Three frames of evidence in one bin each: what comes before is bound to what comes after.
    clock = PhaseClock(PHASES, 0.5, 1.33, 3)
    for number, phase in enumerate((None, 6)):
        evidence = np.zeros(PHASES)
        if phase is not None:
            evidence[phase] = 1000.0
        clock.update(evidence, 0.2 * number)
    before = clock.beliefs(2)[0]
    assert before.argmax() in (0, 1, 2)
    # Whoever stood was at 6; nobody can have come from ahead.
    assert before[6] > before[4] > 0
    assert before[8:25].max() < 0.5 * before[6]


def test_half_strides_that_look_alike_stay_equally_likely():
    clock = PhaseClock(PHASES, 0.5, 1.33, 1)
    at = np.arange(PHASES) / PHASES
    for number in range(50):
        clock.update(100 * np.cos(4 * np.pi * (at - 0.04 * number)), number / FPS)
    belief = clock.beliefs(1)[0]
    assert belief[:15] == pytest.approx(belief[15:], abs=1e-6)
    assert clock.rate == pytest.approx(1.0, abs=0.1)


def test_forgets():
    clock = PhaseClock(PHASES, 0.5, 1.33, 4)
    run(clock, np.arange(20) / FPS, 50.0)
    clock.reset()
    assert clock.rate == 0.0
    clock.update(np.zeros(PHASES), 100.0)
    assert clock.beliefs(4) == pytest.approx(np.full((1, PHASES), 1 / PHASES))
