# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import astuple

import numpy as np
import pytest

from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.phase import (
    NearLeg,
    PhaseFinder,
    SteadyBody,
    phase_near,
)
from gait_tools.gait_model import render_silhouette

FPS, RATE, HEIGHT = 25, 0.95, 90.0


@pytest.fixture(scope='module')
def bank():
    return default_bank()


def phase_errors(bank, azimuths, told, off=0.01):
    """Return phase errors modulo half a stride; view, place and height told are wrong."""
    rng = np.random.default_rng(0)
    finder = PhaseFinder(bank, MatchingConfig())
    found = []
    for number, (azimuth, view) in enumerate(zip(azimuths, told, strict=True)):
        phase = (0.3 + RATE * number / FPS) % 1
        drawn = render_silhouette(phase, azimuth, HEIGHT)
        image = np.zeros((140, 130), np.uint8)
        top, left = (140 - drawn.shape[0]) // 2, (130 - drawn.shape[1]) // 2
        image[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
        image = np.where(rng.random(image.shape) < 0.2, 255 - image, image).astype(np.uint8)
        dx, dy, dh = HEIGHT * rng.normal(0, off, 3)
        body = BodyFrame(65 + dx, 70 + dy, HEIGHT + dh)
        finder.update(image, None, body, ('average', view), 0, number / FPS)
        belief = finder.belief()
        at = np.angle(belief @ np.exp(4j * np.pi * np.arange(30) / 30)) / (4 * np.pi)
        found.append((at - phase + 0.25) % 0.5 - 0.25)
    return np.array(found), finder


@pytest.mark.parametrize('degrees', [80, 95, -100])
@pytest.mark.parametrize('wrong', [-8, 8])
def test_a_wrong_view_does_not_keep_the_phase_from_being_found(bank, degrees, wrong):
    azimuth, told = np.radians(degrees), np.radians(degrees + wrong)
    found, finder = phase_errors(bank, [azimuth] * 40, [told] * 40)
    assert np.sqrt((found[8:] ** 2).mean()) < 0.03
    assert finder.rate == pytest.approx(RATE, rel=0.1)


def walking(speed=(0.0, 0.0), growth=0.0, noise=0.0, frames=40):
    rng = np.random.default_rng(0)
    for number in range(frames):
        t = number / FPS
        true = BodyFrame(50 + speed[0] * t, 80 + speed[1] * t, 100 * np.exp(growth * t), 0.1)
        dx, dy, dh = rng.normal(0, noise, 3)
        body = BodyFrame(true.center_x + dx, true.center_y + dy, true.height + dh, true.angle)
        yield t, true, body


def test_a_motion_is_believed_the_more_the_longer_it_shows():
    steady = SteadyBody()
    steady.update(BodyFrame(50.0, 80.0, 100.0), 0.0)
    # Of a slope through two frames a fifth counts.
    assert steady.update(BodyFrame(51.0, 80.0, 100.0), 0.04).center_x == pytest.approx(50.6)


def test_jumps_are_taken_at_once():
    steady = SteadyBody()
    for t, _, body in walking():
        steady.update(body, t)
    far = BodyFrame(150.0, 80.0, 100.0)
    assert astuple(steady.update(far, 40 / FPS)) == pytest.approx(astuple(far))
    steady.reset()
    tall = BodyFrame(50.0, 80.0, 200.0)
    assert astuple(steady.update(tall, 41 / FPS)) == pytest.approx(astuple(tall))


@pytest.mark.parametrize(
    ('degrees', 'swap'), [(0, 0.0), (60, 0.0), (180, 0.5), (-150, 0.5), (100, 0.5), (270, 0.0)]
)
def test_the_near_leg_is_the_right_one_of_somebody_walking_to_the_right(degrees, swap):
    assert NearLeg().update(0.3, math.radians(degrees), 0.0) == pytest.approx(0.3 + swap)


def test_a_view_that_wavers_about_the_axis_keeps_its_leg():
    near = NearLeg()
    views = [70, 80, 88, 95, 100, 85, 110, 92, -100, -80]
    found = [near.update(0.02 * k, math.radians(view), 0.1 * k) for k, view in enumerate(views)]
    assert found == pytest.approx([0.02 * k for k in range(len(views))])


def test_who_turns_to_the_other_side_changes_legs_once():
    near = NearLeg()
    found = [near.update(0.02 * k, math.radians(10 * k), 0.1 * k) for k in range(19)]
    swapped = [abs(value - 0.02 * k) > 0.25 for k, value in enumerate(found)]
    assert swapped == [k > 12 for k in range(19)]


def test_waits_for_a_phase_behind_and_takes_a_jump():
    near = NearLeg()
    assert [near.update(phase, 0.0, 0.0) for phase in (0.5, 0.4, 0.45, 0.52)] == [
        0.5,
        0.5,
        0.5,
        0.52,
    ]
    assert near.update(0.02, 0.0, 0.0) == 0.02
    near.reset()
    assert near.update(0.9, 0.0, 0.0) == 0.9
    assert near.update(0.1, 0.0, 0.0) == pytest.approx(0.1)


PHASES = 30


def test_a_clear_phase_and_its_twin_are_trusted_more_than_a_flat_belief():
    clear = np.full(PHASES, 1e-5)
    clear[[3, 18]] = 0.5
    phase, sure = phase_near(clear / clear.sum(), 0.12)
    assert phase == pytest.approx(0.1, abs=1e-3)
    _, doubtful = phase_near(np.full(PHASES, 1 / PHASES), 0.1)
    assert doubtful == pytest.approx(0.2)
    assert 0.98 < sure <= 1


def test_of_two_halves_the_nearer_one_is_taken():
    belief = np.zeros(PHASES)
    belief[[3, 18]] = 0.5
    assert phase_near(belief, 0.65)[0] == pytest.approx(0.6)
    belief[[3, 18]] = 0.8, 0.2
    assert phase_near(belief, 0.65)[0] == pytest.approx(0.6)
    belief[:] = 0
    belief[29] = 1.0
    assert phase_near(belief, 0.03)[0] == pytest.approx(29 / 30)
