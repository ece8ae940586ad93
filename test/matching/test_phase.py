# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import astuple, replace
from functools import cache

import cv2
import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.phase import (
    HEIGHTS,
    FineViews,
    NearLeg,
    PhaseFilter,
    SteadyBody,
    phase_near,
)
from gait_tools.gait_model import BankSpec, build_bank, render_silhouette

PHASES, FPS = 30, 25


def foreign(azimuths, phases=4):
    templates = np.zeros((len(azimuths), phases, 20, 15), np.uint8)
    templates[:, :, 4:16, 5:11] = 255
    names = ('mine',) * len(azimuths)
    return TemplateBank(templates, np.radians(azimuths).astype(np.float32), names, 0.9)


# Walkers as wrongly placed as a path places them.
RATE, HEIGHT = 0.95, 86.4


@cache
def silhouette(phase, azimuth):
    return render_silhouette(phase, azimuth, HEIGHT)


def walked(azimuth, told):
    """Return phase errors modulo half a stride; view, place and height told are wrong."""
    rng = np.random.default_rng(0)
    clock = PhaseFilter(default_bank(), MatchingConfig())
    found = []
    for number in range(40):
        phase = (0.3 + RATE * number / FPS) % 1
        drawn = silhouette(phase, azimuth)
        image = np.zeros((140, 130), np.uint8)
        top, left = (140 - drawn.shape[0]) // 2, (130 - drawn.shape[1]) // 2
        image[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
        image = np.where(rng.random(image.shape) < 0.2, 255 - image, image).astype(np.uint8)
        dx, dy, dh = HEIGHT * rng.normal(0, 0.01, 3)
        body = BodyFrame(65 + dx, 70 + dy, HEIGHT + dh)
        clock.add_frame(image, None, body, ('average', told), 0, number / FPS)
        at, _ = phase_near(clock.belief(), phase)
        found.append((at - phase + 0.25) % 0.5 - 0.25)
    return np.array(found), clock.rate


@pytest.mark.parametrize('degrees', [80, 95, -100])
@pytest.mark.parametrize('wrong', [-8, 8])
def test_a_wrong_view_does_not_keep_the_phase_from_being_found(degrees, wrong):
    found, rate = walked(np.radians(degrees), np.radians(degrees + wrong))
    assert np.sqrt((found[8:] ** 2).mean()) < 0.03
    assert rate == pytest.approx(RATE, rel=0.1)


# The evidence of one frame.
PHASE = 8
BODY = BodyFrame(65.0, 70.0, HEIGHT)


def picture(azimuth, height=HEIGHT, down=0.0):
    drawn = render_silhouette(PHASE / 30, azimuth, height, shift=(0.0, down)).astype(float) / 255
    image = np.full((140, 130), 50.0)
    top, left = (140 - drawn.shape[0]) // 2, (130 - drawn.shape[1]) // 2
    part = image[top : top + drawn.shape[0], left : left + drawn.shape[1]]
    part += 150 * drawn
    return image.round().astype(np.uint8)


def compare(image, azimuth, *, body=BODY, known=None):
    clock = PhaseFilter(default_bank(), MatchingConfig())
    clock.choose('average', azimuth)
    return clock.evidence(image, known, body, PHASE, clock.predict(0.0))


@pytest.mark.parametrize('degrees', [0.0, 60.0, 90.0, -110.0])
def test_view_height_row_and_phase_are_found_together(degrees):
    azimuth = np.radians(degrees)
    found = compare(picture(azimuth), azimuth)
    assert found.shape == (7, len(HEIGHTS), 3, 30)
    view, tall, row, phase = np.unravel_index(found.argmax(), found.shape)
    assert (HEIGHTS[tall], row, phase) == (1.0, 1, PHASE)
    # Next to the axes views differ little.
    assert abs(view - 3) <= (0 if 20 < abs(degrees) < 70 else 1)


@pytest.mark.parametrize('factor', HEIGHTS)
@pytest.mark.parametrize('row', [-1, 0, 1])
def test_height_and_row_are_those_of_the_body(factor, row):
    found = compare(picture(1.2, height=HEIGHT * factor, down=row * factor), 1.2)
    _, tall, down, phase = np.unravel_index(found.argmax(), found.shape)
    assert (HEIGHTS[tall], down - 1, phase) == (factor, row, PHASE)


def test_a_leaning_body():
    turn = cv2.getRotationMatrix2D((64.5, 69.5), -20.0, 1.0)
    image = cv2.warpAffine(picture(0.9), turn, (130, 140), borderValue=50.0)
    leaning = compare(image, 0.9, body=BodyFrame(65.0, 70.0, HEIGHT, np.radians(20.0)))
    assert leaning.max() == pytest.approx(compare(picture(0.9), 0.9).max(), rel=0.03)
    assert leaning.max(axis=(0, 1, 2)).argmax() == PHASE


def test_pixels_that_are_unknown_or_beyond_the_image_do_not_count():
    image = picture(1.2)
    known = np.full(image.shape, 255, np.uint8)
    known[:75] = 0
    spoilt = np.where(known, image, 77).astype(np.uint8)
    clean = compare(image, 1.2, known=known)
    assert compare(spoilt, 1.2, known=known) == pytest.approx(clean, abs=1e-3)
    assert clean.max(axis=(0, 1, 2)).argmax() == PHASE
    known[:], known[:, :70] = 0, 255
    cut = compare(np.ascontiguousarray(image[:, :70]), 1.2)
    assert cut == pytest.approx(compare(image, 1.2, known=known), rel=0.1)
    away = BodyFrame(900.0, 70.0, HEIGHT)
    for mask in (None, known):
        assert not compare(image, 1.2, body=away, known=mask).any()


def test_views_go_round():
    drawn = build_bank(BankSpec(height=96, width=64, azimuths=4, phases=4, builds='average,coat'))
    views = FineViews(drawn)
    assert views.templates is drawn.finer.templates
    assert views.reach == 3
    step = 2 * math.pi / 64
    for azimuth in np.linspace(-3.1, 3.1, 9):
        around, moved = views.around('coat', azimuth, azimuth)
        away = abs(np.exp(1j * views.azimuths[around[3]]) - np.exp(1j * azimuth))
        assert (away <= step / 2 + 1e-6, moved, len(set(around))) == (True, 0, 7)
        after, moved = views.around('coat', azimuth + step, azimuth)
        assert (after[:-1], moved) == (around[1:], 1)
    last, first = math.pi - 0.1, -math.pi + 0.1
    assert views.around('average', first, last)[1] == 2
    assert views.around('average', last, first)[1] == -2
    # Towards the camera and away: nobody turns that fast.
    assert views.around('average', -1.5, 1.4)[1] == 1
    likely = views.cells[:, 1, 1]
    assert likely.argmax() == 3
    assert likely == pytest.approx(likely[::-1])


@pytest.mark.parametrize(
    ('azimuths', 'reach'),
    [([0], 0), ([0, 180], 0), (list(range(0, 360, 45)), 1), ([0, 30, 60], 0)],
)
def test_views_of_other_banks_are_used_where_they_are_close(azimuths, reach):
    drawn = foreign(azimuths)
    views = FineViews(drawn)
    assert views.reach == reach
    assert views.templates.shape == (len(azimuths), 4, 48, 36)
    assert views.templates.mean() == pytest.approx(drawn.templates.mean(), rel=0.02)
    assert len(views.around('mine', 0.0, 0.0)[0]) == 2 * reach + 1


# What the filter makes of evidence.
def seen(phase, contrast, rng):
    # Neighbouring phases look alike, and so do their errors.
    at = 2 * np.pi * np.arange(PHASES) / PHASES
    a, b, c, d = rng.normal(0, 12.0, 4)
    errors = a * np.cos(at) + b * np.sin(at) + c * np.cos(2 * at) + d * np.sin(2 * at)
    # A factor of e is worth less where errors are as large as these.
    return 0.6 * (contrast * np.cos(at - 2 * np.pi * phase) + errors)


def across(phase, view, rng):
    """Evidence of seven views, of which the wrong ones are sure of another phase."""
    wrong = [seen(phase + 0.3, 60.0, rng) - 25.0 * abs(view - other) for other in range(7)]
    wrong[view] = seen(phase, 60.0, rng)
    return np.array(wrong)


def clock_of(lag=0, bank=None):
    return PhaseFilter(bank or foreign([0], PHASES), MatchingConfig(lag=lag))


def take_in(clock, evidence, seconds, moved=0):
    """Take in evidence (P,) or (V, P), the same for all heights and rows."""
    wanted = clock.predict(seconds, moved)
    every = np.broadcast_to(np.atleast_2d(evidence)[:, None, None], (*wanted.shape, PHASES))
    clock.correct(np.where(wanted[..., None], every, -np.inf))


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
    clock = clock_of()
    beliefs = run(clock, phases, 15.0)
    rng = np.random.default_rng(0)
    alone = [seen(phase, 15.0, rng).argmax() / PHASES for phase in phases]
    assert np.abs((alone - phases + 0.5) % 1 - 0.5).mean() > 0.12
    assert off(beliefs, phases)[50:].mean() < 0.05
    assert clock.rate == pytest.approx(rate, rel=0.1)
    assert beliefs.sum(axis=1) == pytest.approx(1)


def test_somebody_who_stops_stands():
    phases = np.concatenate([np.arange(50) / FPS, np.full(40, 2.0)])
    clock = clock_of()
    beliefs = run(clock, phases, 60.0)
    assert clock.rate < 0.1
    assert off(beliefs, phases)[-20:].mean() < 0.03


def test_later_frames_correct_earlier_ones():
    phases = 0.1 + 0.9 * np.arange(60) / FPS
    clock = clock_of(lag=59)
    filtered = run(clock, phases, 15.0)
    later = np.array([clock.belief(back) for back in reversed(range(60))])
    assert later[-1] == pytest.approx(filtered[-1])
    assert off(later, phases).mean() < 0.9 * off(filtered, phases).mean()


def test_half_strides_that_look_alike_stay_equally_likely():
    clock = clock_of()
    at = np.arange(PHASES) / PHASES
    for number in range(50):
        take_in(clock, 100 * np.cos(4 * np.pi * (at - 0.04 * number)), number / FPS)
    belief = clock.belief()
    assert belief[:15] == pytest.approx(belief[15:], abs=1e-6)
    assert clock.rate == pytest.approx(1.0, abs=0.1)


def test_the_view_is_found_with_the_phase_and_the_others_are_not_looked_at_any_more():
    rng = np.random.default_rng(1)
    phases = 0.2 + 0.9 * np.arange(40) / FPS
    clock = clock_of(bank=default_bank())
    assert clock.predict(0.0).all()
    found = []
    for number, phase in enumerate(phases):
        take_in(clock, across(phase, 2, rng), number / FPS)
        found.append(clock.belief())
    assert off(np.array(found), phases)[10:].mean() < 0.03
    likely = clock.predict(40 / FPS)
    assert likely[2].all()
    assert not likely[5].any()


def test_views_move_on_with_somebody_who_turns():
    phases = 0.2 + 0.9 * np.arange(60) / FPS
    found = {}
    for told in (True, False):
        rng = np.random.default_rng(2)
        clock = clock_of(59, default_bank())
        for number, phase in enumerate(phases):
            view = 4 if number < 20 else 2
            moved = 2 if told and number == 20 else 0
            take_in(clock, across(phase, view, rng), number / FPS, moved)
            if number == 20:
                found[told] = clock.predict((number + 1) / FPS)[2].all()
        smoothed = np.array([clock.belief(back) for back in reversed(range(60))])
        assert off(smoothed, phases).mean() < 0.03
    assert found[True]


def test_one_frame_rules_no_phase_out():
    clock = clock_of()
    take_in(clock, np.where(np.arange(PHASES) == 6, 1e4, 0.0), 0.0)
    belief = clock.belief()
    assert belief.argmax() == 6
    assert belief.min() == pytest.approx(np.exp(-12.0), rel=0.01)


def test_the_past_is_seen_from_the_views_of_then():
    clock = clock_of(1, default_bank())
    first, second = np.full((2, 7, PHASES), -1e3)
    first[2, 0] = first[4, 15] = 0.0
    second[2] = 0.0
    take_in(clock, first, 0.0)
    assert clock.belief()[[0, 15]] == pytest.approx([0.5, 0.5], abs=0.01)
    # The third view is now what was the fifth.
    take_in(clock, second, 0.05, 2)
    before = clock.belief(1)
    assert before[15] > 3 * before[0]


@pytest.mark.parametrize('at_once', [True, False])
def test_the_phase_goes_on_by_the_time_between_frames_whenever_it_is_asked_for(at_once):
    """Also where that is more than a quarter of a stride, and halves of one look alike."""
    clock, at, found = clock_of(lag=9), np.arange(PHASES) / PHASES, []
    phases = 0.276 * np.arange(10)
    for number, phase in enumerate(phases):
        take_in(clock, 100 * np.cos(4 * np.pi * (at - phase)), 0.3 * number)
        if at_once:
            found.append(clock.phase(0, 0.0, 0.0)[0])
    if not at_once:
        found = [clock.phase(back, 0.0, 0.0)[0] for back in reversed(range(10))]
    assert np.abs((found - phases + 0.5) % 1 - 0.5).max() < 0.05


# What goes in, and what comes out.
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
    # What was more than 0.8 s before does not count.
    aside = replace(tall, center_x=52.0)
    assert astuple(steady.smooth(aside, 62 / FPS)) == pytest.approx(astuple(aside))


@pytest.mark.parametrize(
    ('degrees', 'swap'), [(0, 0.0), (60, 0.0), (180, 0.5), (-150, 0.5), (100, 0.5), (270, 0.0)]
)
def test_the_near_leg_is_the_right_one_of_somebody_walking_to_the_right(degrees, swap):
    assert NearLeg().phase_of(0.3, math.radians(degrees)) == pytest.approx(0.3 + swap)


def test_a_view_that_wavers_about_the_axis_keeps_its_leg():
    near = NearLeg()
    views = [70, 80, 88, 95, 100, 85, 110, 92, -100, -80]
    found = [near.phase_of(0.02 * k, math.radians(view)) for k, view in enumerate(views)]
    assert found == pytest.approx([0.02 * k for k in range(len(views))])


def test_who_turns_to_the_other_side_changes_legs_once():
    near = NearLeg()
    found = [near.phase_of(0.02 * k, math.radians(10 * k)) for k in range(19)]
    swapped = [abs(value - 0.02 * k) > 0.25 for k, value in enumerate(found)]
    assert swapped == [k > 12 for k in range(19)]


def test_waits_for_a_phase_behind_and_takes_a_jump():
    near = NearLeg()
    assert [near.phase_of(phase, 0.0) for phase in (0.5, 0.4, 0.45, 0.52)] == [
        0.5,
        0.5,
        0.5,
        0.52,
    ]
    assert near.phase_of(0.02, 0.0) == 0.02
    near = NearLeg()
    assert near.phase_of(0.9, 0.0) == 0.9
    assert near.phase_of(0.1, 0.0) == pytest.approx(0.1)


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
