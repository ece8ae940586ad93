# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds of any stream: it can be ended, begin again, come later, mirrored or elsewhere."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest

from benchmarks.synthetic import SyntheticFrame
from gait_segmentation.cli.tool import preset_file, read_parameter_file
from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, PeopleMatcher
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.results import Feedback
from gait_segmentation.segmentation import PeopleSegmenter
from gait_segmentation.tracking import PeopleTracker
from test.state import differences, remembered
from test.walkers import box_of, clip, couple, overlap, small_bank

PAPER = read_parameter_file(preset_file('paper')).config
BOXES = DetectorConfig(network='boxes')
"""Networks that draw nobody, which takes longest, where others are of a film of that kind."""

CONFIGS = {
    'default': PipelineConfig(),
    'late': PipelineConfig(matching=MatchingConfig(lag=3), detector=BOXES),
    'paper': PAPER,
    'two': PipelineConfig(people=PeopleConfig(max_people=2)),
    'found': PipelineConfig(),
}


SHORT, LONG = 12, 20
"""Frames of films with first boxes, and in which a walker is found without a box."""

YEAR_NS = 365 * 86_400 * 10**9


def film_for(name: str) -> tuple[SyntheticFrame, ...]:
    """Return a film of as many people as are looked for, long enough to find them if need be."""
    return couple() if name == 'two' else clip(frames=LONG if name == 'found' else SHORT)


def played(
    pipe: Pipeline, frames: tuple[SyntheticFrame, ...], *, later_ns: int = 0
) -> list[FrameResult]:
    """Return what a pipeline makes of a film, with true first boxes but for a long one."""
    results = []
    for number, frame in enumerate(frames):
        if number == 0 and len(frames) < LONG:
            for slot in range(pipe.config.people.max_people):
                pipe.initialize(box_of(frame, slot))
        results += pipe.update(frame.image, frame.stamp_ns + later_ns)
    return results + pipe.flush()


class Run(NamedTuple):
    """
    What a pipeline makes of a film a year later, and then of the same film as it is.

    ``left`` are the ways to what is remembered after a reset, and not by a new pipeline.
    """

    first: list[FrameResult]
    again: list[FrameResult]
    left: list[str]


@cache
def run(name: str) -> Run:
    film = film_for(name)
    pipe, fresh = (Pipeline(CONFIGS[name], small_bank()) for _ in range(2))
    # The second time stamps go back.
    first, again = (played(pipe, film, later_ns=later_ns) for later_ns in (YEAR_NS, 0))
    # Back the same way, beside heat maps.
    step_ns = film[1].stamp_ns - film[0].stamp_ns
    *back, last = film[-2:-7:-1]
    stamps = iter(range(film[-1].stamp_ns + step_ns, 2 * YEAR_NS, step_ns))
    for frame in back:
        heat = frame.masks[0] if name == 'late' else None
        pipe.update(frame.image, next(stamps), heat_map=heat)
    # What is not fed back yet, and what waits for the next frame.
    pipe.update(last.image, next(stamps), learn=False)
    pipe.initialize(box_of(film[0]))
    pipe.add_heat_map(film[0].masks[0], next(stamps))
    pipe.reset()
    # Threads and networks may be used again.
    known = (remembered(each, 'pools', '_pool', '_networks') for each in (pipe, fresh))
    return Run(first, again, differences(*known))


def told(result: FrameResult, later_ns: int = 0) -> dict[str, Any]:
    """Return a result but for ids and times of work, as if it had come so much sooner."""
    known = remembered(result, 'track_id', 'timings_ms')
    for way in [each for each in known if each.endswith('stamp_ns')]:
        known[way] = int(known[way]) - later_ns
    return known


@pytest.mark.parametrize('name', CONFIGS)
def test_a_reset_leaves_nothing_of_what_was(name: str) -> None:
    assert run(name).left == []


@pytest.mark.parametrize('name', CONFIGS)
def test_when_a_film_was_taken_does_not_matter_nor_what_was_before(name: str) -> None:
    """A film after itself, and a year before, gives the same bits."""
    for one, two in zip(run(name).first, run(name).again, strict=True):
        assert differences(told(one, YEAR_NS), told(two)) == []


def mirrored(frame: SyntheticFrame) -> SyntheticFrame:
    """Return a frame with left and right exchanged."""
    image, mask = (np.ascontiguousarray(a[:, ::-1]) for a in (frame.image, frame.masks[0]))
    box = box_of(frame)
    there = Box(mask.shape[1] - box.right, box.y, box.width, box.height)
    return replace(frame, image=image, masks=(mask,), boxes=(there,))


def leaning(frame: SyntheticFrame) -> SyntheticFrame:
    """Return a frame turned by 25 degrees, so that heads are to the right."""
    (height, width), mask = frame.masks[0].shape, frame.masks[0]
    turn = cv2.getRotationMatrix2D((width / 2 - 0.5, height / 2 - 0.5), -25, 1)
    image = cv2.warpAffine(frame.image, turn, (width, height), borderMode=cv2.BORDER_REFLECT)
    mask = np.asarray(cv2.warpAffine(mask, turn, (width, height), flags=cv2.INTER_NEAREST))
    return replace(frame, image=np.asarray(image), masks=(mask,), boxes=(Box.around(mask),))


def elsewhere(frame: SyntheticFrame) -> SyntheticFrame:
    """Return a frame in which all is 6 pixels to the right and 4 up."""
    image = cv2.copyMakeBorder(frame.image, 0, 4, 6, 0, cv2.BORDER_REFLECT)
    box = box_of(frame).shifted(6, -4)
    return replace(frame, image=np.ascontiguousarray(image[4:, :-6]), boxes=(box,))


@pytest.mark.parametrize(
    ('name', 'change'), [('default', leaning), ('late', None), ('paper', None)]
)
def test_a_mirrored_film_gives_mirrored_results(name: str, change: Any) -> None:
    film = tuple(map(change, clip())) if change else film_for(name)
    turned = tuple(map(mirrored, film))
    results = played(Pipeline(CONFIGS[name], small_bank()), film) if change else run(name).first
    others = played(Pipeline(CONFIGS[name], small_bank()), turned)
    # At first the lean is found in turned pixels, which are not those of the mirror.
    for one, two in list(zip(results, others, strict=True))[4:]:
        assert overlap(one.mask, two.mask[:, ::-1]) > 0.93
        here, there = one.people[0], two.people[0]
        width = one.mask.shape[1]
        assert there.track.body.height == pytest.approx(here.track.body.height, rel=0.02)
        assert width - there.match.body.center_x == pytest.approx(here.match.body.center_x, abs=3)
        assert there.track.angle == pytest.approx(-here.track.angle, abs=0.03)
        assert there.match.body.angle == pytest.approx(-here.match.body.angle, abs=0.03)
        # Who walks to the left shows the other leg.
        off = there.match.phase - here.match.phase - 0.5
        assert math.remainder(off, 1.0) == pytest.approx(0, abs=0.06)
        # From the front and from behind silhouettes are alike.
        ahead, back = (np.exp(1j * each.match.azimuth) for each in (here, there))
        across_and_along = (-ahead.real, abs(ahead.imag))
        assert (back.real, abs(back.imag)) == pytest.approx(across_and_along, abs=0.1)
        assert there.match.phase_rate == pytest.approx(here.match.phase_rate, abs=0.06)
    assert (here.track.angle > 0.2) == (change is leaning)


def test_a_film_taken_elsewhere_gives_the_same_there() -> None:
    film = clip(frames=SHORT)
    # The detector's boxes are not the same by pixels elsewhere.
    config = PipelineConfig(detector=DetectorConfig(network='none'))
    pairs = [
        played(Pipeline(config, small_bank()), frames)
        for frames in (film, tuple(map(elsewhere, film)))
    ]
    for one, two in zip(*pairs, strict=True):
        assert overlap(one.mask[4:, :-6], two.mask[:-4, 6:]) > 0.98
        here, there = one.people[0].match.body, two.people[0].match.body
        moved = there.center_x - here.center_x, there.center_y - here.center_y
        assert moved == pytest.approx((6, -4), abs=0.5)
        assert there.height == pytest.approx(here.height, rel=0.01)


def test_masks_that_come_late_teach_what_they_teach_as_soon_as_they_come() -> None:
    """A lag gives the same bits as stages in a row whose masks come back so much later."""
    film, lag = film_for('late'), CONFIGS['late'].matching.lag
    tracker = PeopleTracker(small_bank(), scheduler=DetectorScheduler(BOXES))
    segmenter = PeopleSegmenter()
    matcher = PeopleMatcher(small_bank(), CONFIGS['late'].matching)
    tracker.initialize(box_of(film[0]))
    shown, found = [], []
    for frame in film:
        (track,) = tracker.update(frame.image, frame.stamp_ns)
        shown.append((frame, track))
        for (match,) in matcher.update([track], source_size=frame.image.shape[1::-1]):
            past, then = shown[-1 - lag]
            masks = segmenter.update(past.image, [then.likelihood], [match])
            found.append(masks.mask.copy())
            body, prior = match.body, match.shape_prior
            tracker.learn([Feedback(past.stamp_ns, 1, masks.mask, body, prior)])
    results = run('late').again
    assert [each.stamp_ns for each in results] == [frame.stamp_ns for frame in film]
    assert len(found) == len(film) - lag
    for mask, result in zip(found, results, strict=False):
        np.testing.assert_array_equal(mask, result.mask)


def test_what_is_remembered_does_not_grow() -> None:
    """Somebody who walks to and fro, beside heat maps."""
    pipe, film, sizes = Pipeline(CONFIGS['late'], small_bank()), clip(), []
    pipe.initialize(box_of(film[0]))
    for number in range(50):
        frame = film[number % 16 if number // 16 % 2 == 0 else -1 - number % 16]
        stamp_ns = 10**9 + number * 40_000_000
        pipe.update(frame.image, stamp_ns, heat_map=frame.masks[0])
        if number in (35, 49):
            sizes.append(len(pickle.dumps(list(remembered(pipe).values()))))
    assert sizes[1] < 1.005 * sizes[0]
