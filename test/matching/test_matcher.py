# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import gc
import math
import tracemalloc
from functools import cache

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.results import TrackResult
from gait_tools.gait_model import BankSpec, build_bank
from gait_tools.gait_model.render import render_silhouette
from test.state import differences, remembered

SIZE = (150, 130)  # width, height
HEIGHT, FPS, RATE = 80.0, 20, 1.0


@pytest.fixture(scope='module')
def bank():
    return build_bank(BankSpec(height=48, width=32, azimuths=8, phases=20))


def config(**parameters):
    return MatchingConfig(**{'shifts_x': 4, 'shifts_y': 2, 'scales': 1, **parameters})


@cache
def silhouette(phase, azimuth):
    return render_silhouette(phase, azimuth, HEIGHT)


def walk(azimuth, frames, shift=0, noise=0.0):
    """
    Yield stamp, phase, likelihood and box of somebody who is seen from one direction or several.

    Of the pixels a share of noise is turned over.
    """
    rng = np.random.default_rng(0)
    for number, seen_from in enumerate(np.broadcast_to(azimuth, frames).tolist()):
        phase = (0.2 + RATE * number / FPS) % 1
        drawn = silhouette(phase, seen_from)
        image = np.zeros((SIZE[1], SIZE[0] + 200), np.uint8)
        y, x = (SIZE[1] - drawn.shape[0]) // 2, (SIZE[0] - drawn.shape[1]) // 2
        image[y : y + drawn.shape[0], 100 + x + shift : 100 + x + shift + drawn.shape[1]] = drawn
        box = Box.around(image > 127).shifted(-100, 0)
        image = image[:, 100:250]
        image = np.where(rng.random(image.shape) < noise, 255 - image, image)
        yield 10**9 + number * 10**9 // FPS, phase, image, box


def take_in(matcher, image, box, stamp, *, track_id=1, angle=0.0, known=None):
    track = TrackResult(stamp, track_id, box, image, 1.0, angle)
    return matcher.add_frame(track, SIZE, known)


def run(matcher, frames, **more):
    results = []
    for stamp, _, image, box in frames:
        results += take_in(matcher, image, box, stamp, **more)
    return results


def off(results, frames, azimuth):
    swap = 0.0 if math.cos(azimuth) > -1e-9 else 0.5
    error = [r.phase - f[1] - swap for r, f in zip(results, frames, strict=True)]
    return (np.array(error) + 0.25) % 0.5 - 0.25


@pytest.mark.parametrize('degrees', [0, 45, 180, -135])
def test_finds_phase_view_and_place(bank, degrees):
    azimuth = math.radians(degrees)
    frames = list(walk(azimuth, 25))
    results = run(SequenceMatcher(bank, config()), frames)
    assert [r.stamp_ns for r in results] == [f[0] for f in frames]
    assert np.abs(off(results, frames, azimuth)[5:]).max() < 0.04
    last = results[-1]
    assert abs(abs(last.azimuth) - abs(azimuth)) < math.radians(15)
    assert last.phase_rate == pytest.approx(RATE, abs=0.1)
    assert last.similarity > 0.85
    assert last.confidence > 0.5
    assert last.body.height == pytest.approx(HEIGHT, rel=0.04)
    prior, image = last.shape_prior > 127, frames[-1][2] > 127
    assert (prior & image).sum() / (prior | image).sum() > 0.85


def grown(start, end):
    """Return a box that is right at first and then grows or shrinks."""
    return lambda box, number: resized(box, start + (end - start) * min(number / 10, 1))


def resized(box, factor):
    return Box.from_center(box.center_x, box.center_y, factor * box.width, factor * box.height)


def aside(shift):
    """Return a box that is off by so many placements in a frame."""
    return lambda box, number: box.shifted(shift(number) * 0.02 * HEIGHT, 0.0)


HEIGHTS, SHIFTS = {'scales': 3, 'scale_reach': 1}, {'shifts_x': 6, 'shift_reach': 1}


@pytest.mark.parametrize(
    ('parameters', 'frames', 'wrong', 'lost'),
    [
        (HEIGHTS, 25, grown(1.0, 0.82), ()),
        (HEIGHTS, 25, grown(1.0, 1.22), ()),
        # Off at once by as much as is searched.
        (HEIGHTS, 1, grown(0.82, 0.82), ()),
        (HEIGHTS, 1, grown(1.22, 1.22), ()),
        # The same, and then slowly over to the other side.
        ({**SHIFTS, 'shifts_x': 5}, 40, aside(lambda number: 5 - number / 4), ()),
        ({**SHIFTS, 'shifts_x': 5}, 40, aside(lambda number: number / 4 - 5), ()),
        # All of a sudden: the path goes a placement a frame.
        (SHIFTS, 25, aside(lambda number: 4 * (number >= 15)), range(15, 19)),
        (SHIFTS, 25, aside(lambda number: -4 * (number >= 15)), range(15, 19)),
    ],
)
def test_the_body_is_followed_where_the_box_is_wrong(bank, parameters, frames, wrong, lost):
    matcher = SequenceMatcher(bank, config(**parameters))
    for number, (stamp, _, image, box) in enumerate(walk(0.3, frames)):
        given = wrong(box, number)
        (result,) = take_in(matcher, image, given, stamp)
        if number not in lost:
            # The axis of the body is not the middle of its box.
            assert abs(result.body.center_x - box.center_x) < 0.06 * HEIGHT
    assert result.body.height == pytest.approx(HEIGHT, rel=0.04 if frames > 1 else 0.08)
    # And the box goes where the body is; the refined one is about all that is likely there.
    assert result.placed.iou(box) > 0.7
    assert result.box.iou(box) > 0.8
    matcher = SequenceMatcher(bank, config(**parameters, use_likely_box=False))
    (paper,) = take_in(matcher, image, given, stamp)
    assert paper.box == paper.placed != result.box


def test_the_body_stays_where_it_is_while_the_box_moves_between_placements(bank):
    stamp, _, image, box = next(walk(0.3, 1))
    bodies = []
    for part in np.linspace(0.0, 1.0, 9):
        # Neighbouring placements are 2 % of the height apart, neighbouring heights 8 %.
        off = 0.02 * HEIGHT * part
        moved = resized(box.shifted(off, off), 1.08 ** (part - 0.5))
        matcher = SequenceMatcher(bank, config(scale_cost=0.0))
        (result,) = take_in(matcher, image, moved, stamp)
        body = result.body
        bodies.append((body.center_x, body.center_y, HEIGHT * math.log(body.height)))
    assert (np.ptp(bodies, axis=0) / HEIGHT < (0.025, 0.025, 0.06)).all()


def test_a_lag_gives_each_frame_once_and_flush_or_nobody_the_rest(bank):
    frames = list(walk(0.0, 12))
    matcher = SequenceMatcher(bank, config(lag=4))
    assert run(matcher, frames[:4]) == []
    results = run(matcher, frames[4:])
    assert len(results) == 8
    results += matcher.flush()
    assert [r.stamp_ns for r in results] == [f[0] for f in frames]
    assert matcher.flush() == []
    assert np.abs(off(results, frames, 0.0)).max() < 0.04
    # Without a box the path ends.
    matcher = SequenceMatcher(bank, config(lag=4))
    run(matcher, frames[:5])
    stamp, _, image, _ = frames[5]
    results = take_in(matcher, image, None, stamp, track_id=0)
    assert [r.stamp_ns for r in results] == [f[0] for f in frames[1:6]]
    assert [r.track_id for r in results] == [1] * 4 + [0]
    assert results[-1].body is None
    assert not results[-1].shape_prior.any()


@pytest.mark.parametrize('how', ['half out of the image', 'hidden'])
def test_what_is_not_seen_of_a_person_is_left_out(bank, how):
    frames, known = list(walk(0.0, 15, shift=-72 if how != 'hidden' else 0)), None
    if how == 'hidden':
        known = np.full((SIZE[1], SIZE[0]), 255, np.uint8)
        known[:60] = 0
        frames = [(s, p, np.where(known, i, 255).astype(np.uint8), b) for s, p, i, b in frames]
    results = run(SequenceMatcher(bank, config()), frames, known=known)
    assert np.abs(off(results, frames, 0.0)[5:]).max() < 0.06
    assert results[-1].similarity > 0.8


def test_a_tilted_body_is_sampled_upright(bank):
    frames = list(walk(0.0, 12))
    center = frames[0][3].center_x, frames[0][3].center_y
    turn = cv2.getRotationMatrix2D(center, -20, 1.0)
    tilted = [(s, p, cv2.warpAffine(image, turn, SIZE), b) for s, p, image, b in frames]
    upright = run(SequenceMatcher(bank, config()), tilted)
    turned = run(SequenceMatcher(bank, config()), tilted, angle=math.radians(20))
    assert turned[-1].similarity > upright[-1].similarity + 0.1
    assert turned[-1].body.angle == pytest.approx(math.radians(20))
    prior, image = turned[-1].shape_prior > 127, tilted[-1][2] > 127
    assert (prior & image).sum() / (prior | image).sum() > 0.8


@pytest.mark.parametrize(('track_id', 'pause'), [(2, 0), (1, 5 * 10**9)])
@pytest.mark.parametrize('lag', [0, 3])
def test_another_person_or_a_long_pause_leaves_nothing_of_what_was(bank, track_id, pause, lag):
    used, fresh = (SequenceMatcher(bank, config(lag=lag)) for _ in range(2))
    before = [(stamp - 10**9 // 2, *rest) for stamp, *rest in walk(math.pi, 9, noise=0.1)]
    later = [(stamp + pause, *rest) for stamp, *rest in walk(0.3, 9)]
    first = run(used, before)
    results, expected = (
        run(each, later, track_id=track_id) + each.flush() for each in (used, fresh)
    )
    # With a lag they tell the rest of what was before.
    results = results[len(before) - len(first) :]
    assert len(results) == len(expected) == 9
    for one, two in zip(results, expected, strict=True):
        assert differences(remembered(one), remembered(two)) == []


def test_nothing_seen_is_not_believed(bank):
    stamp, _, image, box = next(walk(0.0, 1))
    (result,) = take_in(SequenceMatcher(bank, config()), image * 0, box, stamp)
    assert (result.similarity, result.confidence) == (0, 0)
    assert (result.placement.dx, result.placement.dy, result.placement.scale) == (0, 0, 1)


def test_memory_does_not_grow(bank):
    frames, matcher, taken = list(walk(0.3, 20)), SequenceMatcher(bank, config(lag=2)), []
    tracemalloc.start()
    for number in range(130):
        _, _, image, box = frames[number % len(frames)]
        stamp = 10**9 + number * 10**9 // FPS
        take_in(matcher, image, box, stamp)
        if number in (80, 129):
            # Also empties the interpreter's lists of freed objects.
            gc.collect()
            taken.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert taken[1] - taken[0] < 20_000


def test_the_phase_goes_on_while_the_view_crosses_the_axis(bank):
    # From 22.5 degrees on, the next view of this bank is as near, from which the leg is seen.
    views = math.pi / 2 + np.deg2rad(15) * np.sin(np.arange(60) / 8)
    results = run(SequenceMatcher(bank, config()), walk(views, 60, noise=0.2))
    steps = (np.diff([r.phase for r in results]) + 0.5) % 1 - 0.5
    assert (steps >= 0).all()
    assert steps.max() < 0.35


@pytest.mark.parametrize(
    'wrong',
    [
        {'lag': -1},
        {'window': 0.0},
        {'memory': float('nan')},
        {'levels': 1},
        {'minimum_cadence': 120.0, 'maximum_cadence': 120.0},
    ],
)
def test_refuses_values_with_their_name(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        MatchingConfig(**wrong)


@pytest.mark.parametrize('cost', [0.0, 2.0])
def test_another_height_than_that_of_the_box_has_its_cost(bank, cost):
    # The body is as much higher than its box as the heights searched differ.
    frames = [(*seen, box.padded(0, -0.037 * box.height)) for *seen, box in walk(0.0, 5)]
    last = run(SequenceMatcher(bank, config(scale_cost=cost)), frames)[-1]
    assert (last.placement.scale < 1.045) == (cost > 0)


def test_a_box_that_was_scaled_with_the_body_keeps_its_proportions(bank):
    frames = [(*seen, box.padded(0, -0.037 * box.height)) for *seen, box in walk(0.0, 5)]
    options = config(scale_cost=0.0, use_likely_box=False)
    last = run(SequenceMatcher(bank, options), frames)[-1]
    given = frames[-1][-1]
    assert last.placement.scale > 1.03
    proportions = given.width / given.height
    assert last.box.width / last.box.height == pytest.approx(proportions, rel=1e-3)
