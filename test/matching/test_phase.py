# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import astuple, replace

import numpy as np
import pytest

from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.phase import NearLeg, PhaseFinder, SteadyBody, phase_near
from gait_tools.gait_model import render_silhouette

FPS, RATE, HEIGHT = 25, 0.95, 90.0


def phase_errors(azimuths, told):
    """Return phase errors modulo half a stride; view, place and height told are wrong."""
    rng = np.random.default_rng(0)
    finder = PhaseFinder(default_bank(), MatchingConfig())
    found = []
    for number, (azimuth, view) in enumerate(zip(azimuths, told, strict=True)):
        phase = (0.3 + RATE * number / FPS) % 1
        drawn = render_silhouette(phase, azimuth, HEIGHT)
        image = np.zeros((140, 130), np.uint8)
        top, left = (140 - drawn.shape[0]) // 2, (130 - drawn.shape[1]) // 2
        image[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
        image = np.where(rng.random(image.shape) < 0.2, 255 - image, image).astype(np.uint8)
        dx, dy, dh = HEIGHT * rng.normal(0, 0.01, 3)
        body = BodyFrame(65 + dx, 70 + dy, HEIGHT + dh)
        finder.add_frame(image, None, body, ('average', view), 0, number / FPS)
        belief = finder.clock.belief()
        at = np.angle(belief @ np.exp(4j * np.pi * np.arange(30) / 30)) / (4 * np.pi)
        found.append((at - phase + 0.25) % 0.5 - 0.25)
    return np.array(found), finder


@pytest.mark.parametrize('degrees', [80, 95, -100])
@pytest.mark.parametrize('wrong', [-8, 8])
def test_a_wrong_view_does_not_keep_the_phase_from_being_found(degrees, wrong):
    azimuth, told = np.radians(degrees), np.radians(degrees + wrong)
    found, finder = phase_errors([azimuth] * 40, [told] * 40)
    assert np.sqrt((found[8:] ** 2).mean()) < 0.03
    assert finder.clock.rate == pytest.approx(RATE, rel=0.1)


def test_a_motion_is_believed_the_more_the_longer_it_shows_and_jumps_at_once():
    steady, body = SteadyBody(), BodyFrame(50.0, 80.0, 100.0)
    steady.smooth(body, 0.0)
    # Of a slope through two frames a fifth counts.
    moved = replace(body, center_x=51.0)
    assert steady.smooth(moved, 0.04).center_x == pytest.approx(50.6)
    steady = SteadyBody()
    for number in range(40):
        steady.smooth(body, number / FPS)
    far, tall = replace(body, center_x=150.0), replace(body, height=200.0)
    assert astuple(steady.smooth(far, 40 / FPS)) == pytest.approx(astuple(far))
    steady = SteadyBody()
    assert astuple(steady.smooth(tall, 41 / FPS)) == pytest.approx(astuple(tall))


@pytest.mark.parametrize(
    ('degrees', 'swap'), [(0, 0.0), (60, 0.0), (180, 0.5), (-150, 0.5), (100, 0.5), (270, 0.0)]
)
def test_the_near_leg_is_the_right_one_of_somebody_walking_to_the_right(degrees, swap):
    assert NearLeg().phase_of(0.3, math.radians(degrees), 0.0) == pytest.approx(0.3 + swap)


def test_a_view_that_wavers_about_the_axis_keeps_its_leg():
    near = NearLeg()
    views = [70, 80, 88, 95, 100, 85, 110, 92, -100, -80]
    found = [near.phase_of(0.02 * k, math.radians(view), 0.1 * k) for k, view in enumerate(views)]
    assert found == pytest.approx([0.02 * k for k in range(len(views))])


def test_who_turns_to_the_other_side_changes_legs_once():
    near = NearLeg()
    found = [near.phase_of(0.02 * k, math.radians(10 * k), 0.1 * k) for k in range(19)]
    swapped = [abs(value - 0.02 * k) > 0.25 for k, value in enumerate(found)]
    assert swapped == [k > 12 for k in range(19)]


def test_waits_for_a_phase_behind_and_takes_a_jump():
    near = NearLeg()
    assert [near.phase_of(phase, 0.0, 0.0) for phase in (0.5, 0.4, 0.45, 0.52)] == [
        0.5,
        0.5,
        0.5,
        0.52,
    ]
    assert near.phase_of(0.02, 0.0, 0.0) == 0.02
    near = NearLeg()
    assert near.phase_of(0.9, 0.0, 0.0) == 0.9
    assert near.phase_of(0.1, 0.0, 0.0) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ('belief', 'expected', 'phase', 'doubt'),
    [
        # A clear phase and its twin, of which the nearer one is taken.
        ({3: 0.5, 18: 0.5}, 0.12, 0.1, 0.0),
        ({3: 0.5, 18: 0.5}, 0.65, 0.6, 0.0),
        ({3: 0.8, 18: 0.2}, 0.65, 0.6, 0.0),
        ({29: 1.0}, 0.03, 29 / 30, 0.0),
        (dict.fromkeys(range(30), 1 / 30), 0.1, None, 0.8),
    ],
)
def test_of_what_is_believed_the_phase_nearest_to_the_last_is_taken(
    belief, expected, phase, doubt
):
    values = np.full(30, 1e-9)
    values[list(belief)] = list(belief.values())
    found, sure = phase_near(values / values.sum(), expected)
    assert phase is None or found == pytest.approx(phase, abs=1e-3)
    assert sure == pytest.approx(1 - doubt, abs=0.02)
