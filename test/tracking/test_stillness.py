# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from itertools import count

import numpy as np

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import Networks
from gait_segmentation.detector.scheduler import DetectorScheduler
from test.tracking.figures import HEIGHT, WIDTH, Figure, Told, picture, walk

NOISE = [np.random.default_rng(seed).normal(0, 1.5, (HEIGHT, WIDTH, 3)) for seed in range(8)]
THING = (slice(45, 138), slice(106, 136))


def noisy(image, number):
    return np.clip(image + NOISE[number % len(NOISE)], 0, 255).astype(np.uint8)


def tracked_before_leaving(frames):
    """Return who has come to stand before a thing for so many frames, and what numbers frames."""
    track, numbers = Told(), count()
    path = walk(Figure(60), 20)
    path += [path[-1]] * frames
    track.start(path[0])
    for figure in path:
        image, masks = picture([figure])
        (result,) = track.see(noisy(image, next(numbers)), masks)
        assert result.state == 'tracked'
    return track, numbers


def left_behind(track, numbers, frames):
    """Return the results while a thing of much the same colours stands where somebody was."""
    image, _ = picture([])
    image[THING] = (60, 50, 170)
    image[THING][::8] = (50, 40, 130)
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[THING] = 255
    return [track.see(noisy(image, next(numbers)), [mask])[0] for _ in range(frames)]


def test_what_is_behind_somebody_who_leaves_is_not_taken_for_them():
    track, numbers = tracked_before_leaving(10)
    results = left_behind(track, numbers, 40)
    assert results[2].state == 'tracked'
    assert {each.state for each in results[12:]} == {'lost'}
    assert 'does not move' in results[-1].reason
    for figure in walk(Figure(240), 20, -3.0):
        image, masks = picture([figure])
        (result,) = track.see(noisy(image, next(numbers)), masks)
    assert (result.state, result.track_id) == ('tracked', 1)


def test_who_stands_still_looks_as_before():
    tracked_before_leaving(120)


def test_a_picture_that_is_repeated_says_nothing_of_motion():
    track, numbers = tracked_before_leaving(0)
    number = next(numbers)
    results = left_behind(track, iter([number] * 40), 40)
    assert {each.state for each in results[5:]} == {'tracked'}


def seen_by_a_detector(*figures, score=0.7):
    """Return what is said of a figure in each frame, which a detector sees."""
    network = Networks(lambda image: [Detection(figure.box, score)])
    track, results = Told(1, scheduler=DetectorScheduler(networks=network)), []
    for number, figure in enumerate(figures):
        image, masks = picture([figure])
        results += track.see(noisy(image, number), masks)
    return results


def test_whom_a_detector_is_certain_of_may_stand():
    results = seen_by_a_detector(*[Figure(100)] * 100, score=0.85)
    assert {(each.state, each.track_id) for each in results} == {('tracked', 1)}


def test_what_looks_a_little_like_a_person_must_be_seen_to_move():
    stands = [Figure(100)] * 200
    sways = [Figure(100 + 4 * math.sin(number / 5)) for number in range(100)]
    assert {each.state for each in seen_by_a_detector(*sways)} == {'tracked'}
    results = seen_by_a_detector(*stands, *walk(Figure(200), 30))
    assert {each.state for each in results[:20]} == {'tracked'}
    # The detector goes on seeing it.
    assert {each.state for each in results[40:200]} == {'empty'}
    assert 'hardly moved' in results[40].reason
    assert results[-1].state == 'tracked'


def test_who_only_stood_is_the_same_when_they_walk():
    stands = [Figure(100)] * 60
    results = seen_by_a_detector(*stands, *walk(Figure(100), 20))
    assert results[59].state == 'empty'
    assert {(each.state, each.track_id) for each in results[65:]} == {('tracked', 1)}
