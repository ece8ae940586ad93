# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import dataclasses
import itertools

import numpy as np

from gait_segmentation.images import distance_from
from gait_segmentation.tracking import TrackingConfig, group
from gait_segmentation.tracking.pixels import PixelClaim, associate
from test.tracking.figures import BLUE, STEP_NS, Figure, Told, picture

SHAPE = (60, 100)


def claim(left: int, value: float, feet: float = 50.0, hidden: bool = False) -> PixelClaim:
    """Return what somebody 16 pixels wide makes of a window 40 wide."""
    window = (slice(0, 60), slice(left, left + 40))
    mask = np.zeros(SHAPE, np.uint8)
    mask[5:55, left + 12 : left + 28] = 255
    logit = np.full((60, 40), value, np.float32)
    part = mask[window]
    return PixelClaim(window, logit, part, distance_from(part > 127), feet, 50.0, hidden)


def test_those_who_are_apart_do_not_associate() -> None:
    one, two = claim(0, 3.0), claim(50, 3.0)
    first, second = associate([one, two])
    assert first is one.logit
    assert second is two.logit
    assert associate([one]) == [one.logit]
    assert associate([]) == []


def test_somebody_hidden_keeps_pixels_from_those_they_do_not_suit() -> None:
    alone, _ = associate([claim(0, 3.0), claim(0, -6.0, hidden=True)])
    assert alone[30, 20] > 2.5
    # Who is hidden stands behind, wherever the feet are expected.
    kept, _ = associate([claim(0, 3.0), claim(0, 3.0, 55.0, hidden=True)])
    assert kept[30, 20] > 0
    taken, _ = associate([claim(0, 3.0), claim(0, 6.0, 55.0, hidden=True)])
    assert taken[30, 20] < 0


def test_who_stands_nearer_is_favoured() -> None:
    nearer, farther = associate([claim(0, 3.0, 55.0), claim(0, 3.0, 50.0)])
    assert nearer[30, 20] > 0 > farther[30, 20]
    farther, nearer = associate([claim(0, 3.0, 50.0), claim(0, 3.0, 55.0)])
    assert nearer[30, 20] > 0 > farther[30, 20]
    # Feet are not known to a pixel: hardly lower ones hardly tell.
    likelier, other = associate([claim(0, 3.2, 50.0), claim(0, 3.0, 50.2)])
    assert likelier[30, 20] > 0 > other[30, 20]


def test_a_mask_that_has_taken_in_somebody_does_not_keep_them() -> None:
    one, two = claim(0, 3.0), claim(8, 3.0, 45.0)
    body = np.zeros(SHAPE, np.uint8)
    body[5:55, 12:16] = 255
    kept = associate([one, two])[0]
    left = associate([dataclasses.replace(one, body=body[one.window]), two])[0]
    # Columns 12 to 28 are in its mask, and 20 to 36 in that of the other.
    assert kept[30, 14] > 0 < left[30, 14]
    assert left[30, 24] < 0
    assert left[30, 24] < kept[30, 24]


def test_several_compete_as_their_densities_say() -> None:
    """By plain sums over all pixels of the image, window after window."""
    alone = claim(0, 0.0, 50.0)
    # What a point that is as likely behind somebody nearer is worth says how much nearer counts.
    nearer = associate([alone, claim(0, 0.0, 55.0)])[0][30, 20]
    bonus = float(np.log(np.expm1(-nearer)))
    rng = np.random.default_rng(5)
    feet = {0: 50.0, 9: 55.0, 30: 52.0}
    claims = [claim(left, 0.0, below) for left, below in feet.items()]
    for each in claims:
        each.logit[:] = rng.normal(0, 3, each.logit.shape)
    expected = []
    for one in claims:
        rivals = np.zeros(SHAPE)
        for other in claims:
            if other is not one:
                depth = bonus * np.clip((other.feet - one.feet) / (0.05 * 50.0), -1, 1)
                rivals[other.window] += np.exp(other.logit + other.falloff + depth)
        expected.append(one.logit - np.log1p(rivals[one.window]))
    for first, second in itertools.combinations(range(3), 2):
        here, there = (np.full(SHAPE, -np.inf) for _ in range(2))
        favour = [np.full(SHAPE, -np.inf) for _ in range(2)]
        for k, image, own in ((first, here, favour[0]), (second, there, favour[1])):
            image[claims[k].window] = expected[k]
            own[claims[k].window] = expected[k] + claims[k].falloff
        both = (here > 0) & (there > 0)
        there[both & (favour[0] >= favour[1])] = here[both & (favour[0] < favour[1])] = -0.5
        expected[first], expected[second] = (
            here[claims[first].window],
            there[claims[second].window],
        )
    before = [each.logit.copy() for each in claims]
    for found, wanted in zip(associate(claims), expected, strict=True):
        np.testing.assert_allclose(found, wanted, atol=0.02)
    np.testing.assert_array_equal([each.logit for each in claims], before)


def test_a_frame_is_learnt_once_and_its_people_are_no_background() -> None:
    told = Told(slots=2)
    people = Figure(60), Figure(200, BLUE)
    told.start(*people)
    told.show(*people)
    (view,) = {track.view for track in told.tracker.tracks()}
    image, masks = picture(people)
    told.tracker.update(image, told.stamp_ns)
    count = view.background.count
    for mask in masks:
        assert count[mask > 0].max() < 0.5
    assert count[60:120, 85:95].min() > 0.9
    # Feedback that comes again says nothing new.
    known = count.copy()
    group.correct(view, told.tracker.tracks(), STEP_NS, {}, TrackingConfig())
    np.testing.assert_array_equal(view.background.count, known)


def test_who_is_partly_hidden_is_the_less_sure() -> None:
    told = Told(slots=2)
    behind, front = Figure(100), Figure(160, BLUE, y=96)
    told.start(behind, front)
    for x in (160, 152, 144, 136, 130, 126, 122, 118, 114, 112):
        results = told.show(behind, dataclasses.replace(front, x=x))
    hidden, whole = (result.confidence for result in results)
    assert whole > hidden + 0.15
