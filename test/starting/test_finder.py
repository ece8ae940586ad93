# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from collections.abc import Iterable
from functools import cache
from itertools import pairwise

import cv2
import numpy as np
import pytest

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.geometry import Box
from gait_segmentation.scene.scene import Scene
from gait_segmentation.starting import StartingConfig, WalkerFinder
from gait_segmentation.starting.finder import Candidate, seen_again
from gait_segmentation.starting.moving import Blob
from test.walkers import box_of, clip, small_bank

PERIOD_NS = 40_000_000


class Search(WalkerFinder):
    """A finder and the scene it looks at."""

    def __init__(self, config: StartingConfig | None = None, people: int = 1) -> None:
        super().__init__(small_bank(), config, people)
        self.scene: Scene | None = None

    def see(self, image: np.ndarray, stamp_ns: int, *known: Box, **options) -> list[Box]:
        """Take in a frame."""
        if self.scene is None:
            self.scene = Scene(image.shape[:2])
        self.scene.advance(image, stamp_ns)
        return self.update(self.scene, known, **options)


@cache
def walk(pan: float = 0.0) -> tuple[np.ndarray, ...]:
    return tuple(frame.image for frame in clip(pan=pan, frames=40))


@cache
def found_in_walk(pan: float = 0.0) -> list[tuple[int, Box]]:
    return run(walk(pan))


def run(
    images: Iterable[np.ndarray], finder: Search | None = None, begin_ns: int = 10**9
) -> list[tuple[int, Box]]:
    """Return the frames in which somebody was found, and where."""
    finder, found = finder or Search(), []
    for number, image in enumerate(images):
        found += [(number, box) for box in finder.see(image, begin_ns + number * PERIOD_NS)]
    return found


def scene(size: tuple[int, int] = (240, 320), seed: int = 1) -> np.ndarray:
    """Return a place with texture and nobody in it, (H, W, 3) float32."""
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(60, 180, (size[0] // 8, size[1] // 8, 3)).astype(np.float32)
    return cv2.resize(coarse, size[::-1], interpolation=cv2.INTER_CUBIC)


def noisy(image: np.ndarray, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 2, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize('pan', [0.0, 2.0])
def test_a_walker_is_found_with_a_tight_box(pan: float) -> None:
    (number, box), *_ = found_in_walk(pan)
    assert box.iou(box_of(clip(pan=pan, frames=40)[number])) > 0.6


@pytest.mark.parametrize(('people', 'found'), [(1, False), (4, True)])
def test_smaller_people_are_found_where_there_may_be_several(people: int, found: bool) -> None:
    finder, place = Search(people=people), scene((720, 960))
    frames, boxes = clip(pan=0.0, frames=40), []
    scale = 60 / frames[0].boxes[0].height
    for number, frame in enumerate(frames):
        small = cv2.resize(frame.image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        image = place.copy()
        image[300 : 300 + small.shape[0], 300 : 300 + small.shape[1]] = small
        boxes += finder.see(noisy(image, number), frame.stamp_ns)
    assert bool(boxes) == found


def test_who_has_a_slot_is_not_found_again() -> None:
    finder = Search()
    for frame in clip(pan=0.0, frames=40):
        assert finder.see(frame.image, frame.stamp_ns, box_of(frame)) == []


def rigid(width: float) -> Iterable[np.ndarray]:
    """Yield a box that moves as a walker would."""
    for number in range(50):
        image = scene()
        left = 10 + 4 * number
        image[90:190, left : left + round(width * 100)] = (40, 90, 200)
        yield noisy(image, number)


def shaken() -> Iterable[np.ndarray]:
    wide, rng = scene((340, 420)), np.random.default_rng(5)
    for number in range(40):
        x, y = rng.integers(0, 80, 2)
        yield noisy(wide[y : y + 240, x : x + 320], number)


@pytest.mark.parametrize(
    'images',
    [
        rigid(0.4),
        rigid(1.5),
        shaken(),
        (noisy(np.full((120, 160, 3), 128.0), number) for number in range(30)),
        (np.full((3, 5, 3), number, np.uint8) for number in range(12)),
    ],
    ids=['narrow', 'broad', 'shaken', 'noise', 'tiny'],
)
def test_nobody_is_found_where_nobody_walks(images: Iterable[np.ndarray]) -> None:
    assert run(images) == []


def test_a_reset_and_a_pause_begin_anew() -> None:
    for pause_ns in (0, 10**9):
        finder = Search()
        assert run(walk()[:30], finder=finder)
        if not pause_ns:
            finder.stop()
        finder.scene = None
        assert run(walk(), finder, 10**9 + 3 * pause_ns)[0] == found_in_walk()[0]


def test_at_high_frame_rates_frames_are_left_out() -> None:
    sequence = SyntheticSequence(
        SyntheticConfig(seed=3, frames=160, fps=100.0, person_height=110.0)
    )
    finder = Search()
    found = [bool(finder.see(f.image, f.stamp_ns)) for f in sequence]
    assert any(found)
    # Nor is anything said of those that are left out.
    assert not any(one and next_one for one, next_one in pairwise(found))


def test_who_is_on_trial_is_looked_at_but_not_found() -> None:
    finder = Search()
    tried: list[Box] = []
    evidence: list[float] = []
    for frame in clip(pan=0.0, frames=40):
        found = finder.see(frame.image, frame.stamp_ns, tried=tried)
        assert not (found and tried)
        if found or tried:
            tried = [box_of(frame)]
            evidence.append(finder.evidence(tried[0]))
    assert evidence[-1] > 3 * evidence[0] >= 3
    assert finder.evidence(Box(0, 0, 20, 40)) == 0


def test_where_there_was_an_error_and_only_there_more_evidence_is_asked_for() -> None:
    first = found_in_walk()[0][0]
    for where, later in ((Box(0, 0, 320, 240), True), (Box(0, 0, 20, 40), False)):
        config = StartingConfig(least_evidence=0.05) if later else StartingConfig()
        finder = Search(config)
        finder.see(walk()[0], 10**9 - PERIOD_NS)
        finder.reject(where)
        assert (run(walk(), finder=finder)[0][0] > first) == later


def test_a_walker_is_found_beside_what_sways_and_was_nobody() -> None:
    swaying = [image.copy() for image in walk()]
    for number, image in enumerate(swaying):
        left = 160 + round(15 * np.sin(number / 4))
        image[40:210, left : left + 40] = (40, 90, 40)
    clutter = []
    for rejectd in (Box(0, 0, 20, 40), Box(140, 30, 80, 190)):
        finder = Search()
        finder.see(walk()[0], 10**9 - PERIOD_NS)
        finder.reject(rejectd)
        most = 0.0
        for number, image in enumerate(swaying):
            boxes = finder.see(image, 10**9 + number * PERIOD_NS)
            for box, measures in finder.judged:
                if box.iou(box_of(clip(pan=0.0, frames=40)[number])) > 0.6:
                    most = max(most, measures['clutter'])
            if boxes:
                break
        clutter.append(most)
    assert boxes[0].iou(box_of(clip(pan=0.0, frames=40)[number])) > 0.6
    assert clutter[1] < 0.5 * clutter[0]


def test_a_walker_is_found_in_rain() -> None:
    rng = np.random.default_rng(1)
    rainy = [image.copy() for image in walk()]
    for image in rainy:
        for x, y in rng.integers(0, image.shape[1::-1], (120, 2)).tolist():
            cv2.line(image, (x, y), (x - 2, y + 14), (230, 230, 230), 1, cv2.LINE_AA)
    (number, box), *_ = run(rainy)
    assert number < 20
    assert box.iou(box_of(clip(pan=0.0, frames=40)[number])) > 0.5


def test_two_blobs_are_not_confused() -> None:
    candidates: list[Candidate] = []
    for number in range(10):
        both = [20 + 2 * number, 120 - 2 * number]
        blobs = [Blob(Box(x, 20, 20, 60), 900, 600) for x in both]
        candidates = seen_again(candidates, blobs[:: (-1) ** number], 1 + number * 0.04, 24)
    assert [each.sightings for each in candidates] == [10, 10]
    assert candidates[0].speed[0] > 0 > candidates[1].speed[0]


def test_an_error_is_forgotten_after_ten_seconds() -> None:
    found = []
    for seconds in (5, 11):
        finder = Search()
        for number in range(4 * seconds):
            finder.see(walk()[0], (61 - seconds) * 10**9 + number * 250_000_000)
            if number == 0:
                finder.reject(Box(0, 0, 320, 240))
        found.append(run(walk(), finder, 61 * 10**9))
    assert found[1][0][0] <= found_in_walk()[0][0]
    assert found[0] == [] or found[0][0][0] > found[1][0][0]
