# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import json
from collections.abc import Iterable
from functools import cache
from itertools import pairwise

import cv2
import numpy as np
import pytest

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.starting import StartingConfig, WalkerFinder
from gait_segmentation.starting.blobs import Blob, BodyShapes, normalised, tanimoto
from gait_segmentation.starting.finder import MODEL_FILE, Candidate, follow, log_odds
from test.walkers import box_of, clip, small_bank

PERIOD_NS = 40_000_000


@cache
def walk(pan: float = 0.0) -> tuple[np.ndarray, ...]:
    return tuple(frame.image for frame in clip(pan=pan, frames=40))


@cache
def found_in_walk(pan: float = 0.0) -> list[tuple[int, Box]]:
    return run(walk(pan))


def run(
    images: Iterable[np.ndarray],
    config: StartingConfig | None = None,
    occupied: Box | None = None,
    finder: WalkerFinder | None = None,
) -> list[tuple[int, Box]]:
    """Return the frames in which somebody was found, and where."""
    finder = finder or WalkerFinder(small_bank(), config)
    found = []
    for number, image in enumerate(images):
        taken = [] if occupied is None else [occupied]
        boxes = finder.update(image, 10**9 + number * PERIOD_NS, taken)
        found += [(number, box) for box in boxes]
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
    finder, place = WalkerFinder(small_bank(), people=people), scene((720, 960))
    frames, boxes = clip(pan=0.0, frames=40), []
    scale = 66 / frames[0].boxes[0].height
    for number, frame in enumerate(frames):
        small = cv2.resize(frame.image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        image = place.copy()
        image[300 : 300 + small.shape[0], 300 : 300 + small.shape[1]] = small
        boxes += finder.update(noisy(image, number), frame.stamp_ns)
    assert bool(boxes) == found


def test_several_people_are_found_at_once() -> None:
    finder, place = WalkerFinder(small_bank(), people=4), scene((480, 960))
    boxes: list[Box] = []
    for frame in list(clip(pan=0.0, frames=44)):
        small = cv2.resize(frame.image, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA)
        rows, columns = small.shape[:2]
        image = place.copy()
        for left in range(0, 960 - columns + 1, columns):
            for top in range(0, 480 - rows + 1, rows):
                image[top : top + rows, left : left + columns] = small
        boxes += finder.update(noisy(image, 1), frame.stamp_ns)
    assert len(boxes) >= 4


def test_who_has_a_slot_is_not_found_again() -> None:
    frames = clip(pan=0.0, frames=40)
    finder = WalkerFinder(small_bank())
    for frame in frames:
        taken = [box for box in frame.boxes if box is not None]
        assert finder.update(frame.image, frame.stamp_ns, taken) == []


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


def test_off_finds_nobody() -> None:
    assert run(walk(), StartingConfig(auto_init='none')) == []


@pytest.mark.parametrize('how', ['reset', 'stamp', 'size'])
def test_a_reset_a_stamp_that_goes_back_and_another_size_begin_anew(how: str) -> None:
    finder = WalkerFinder(small_bank())
    if how == 'size':
        for number in range(10):
            finder.update(noisy(scene((120, 160)), number), 10**9 - (10 - number) * PERIOD_NS)
    else:
        assert run(walk()[:30], finder=finder)
    if how == 'reset':
        finder.reset()
    assert run(walk(), finder=finder) == found_in_walk()


def test_what_is_no_image_is_refused() -> None:
    finder = WalkerFinder(small_bank())
    with pytest.raises(InputError, match='image'):
        finder.update(np.zeros((10, 10), np.uint8), 1, [])
    with pytest.raises(InputError, match='stamp'):
        finder.update(np.zeros((10, 10, 3), np.uint8), 0, [])


def test_a_small_bank_is_used_as_it_is() -> None:
    bank = small_bank()
    one = TemplateBank(bank.templates[:1], bank.azimuth[:1], bank.builds[:1], bank.fill)
    finder = WalkerFinder(one)
    assert run((frame.image for frame in clip(pan=0.0, frames=5)), finder=finder) == []


def test_at_high_frame_rates_frames_are_left_out() -> None:
    sequence = SyntheticSequence(
        SyntheticConfig(seed=3, frames=160, fps=100.0, person_height=110.0)
    )
    finder = WalkerFinder(small_bank())
    found = [bool(finder.update(f.image, f.stamp_ns)) for f in sequence]
    assert any(found)
    # Nor is anything said of those that are left out.
    assert not any(one and next_one for one, next_one in pairwise(found))


def test_the_place_is_remembered_where_somebody_is_found() -> None:
    frames = clip(pan=0.0, frames=40)
    # Late enough for most of the place to have been seen.
    finder = WalkerFinder(small_bank(), StartingConfig(least_evidence=1.0))
    for frame in frames:
        found = finder.update(frame.image, frame.stamp_ns, [])
        if found:
            break
    (box,) = found
    window = box.padded(10, 5).slices(frame.image.shape[1], frame.image.shape[0])
    assert finder.past(frame.stamp_ns + 1) is None
    past = finder.past(frame.stamp_ns)
    known = past.background(frame.image.shape[:2])
    lab = cv2.cvtColor(frame.image[window], cv2.COLOR_BGR2Lab)
    truth = frame.truths[0][window]
    evidence = known.evidence(lab, window, 0.5)
    sure = known.count[window] > 1.5
    assert sure.mean() > 0.7
    assert np.median(evidence[(truth == 255) & sure]) > 0.5
    assert np.median(evidence[truth == 0]) < -0.5


def test_with_more_evidence_asked_for_a_walker_is_found_later() -> None:
    (usual, _), *_ = found_in_walk()
    more = StartingConfig(least_evidence=1.5)
    (later, _), *_ = run(walk(), more)
    assert later > usual


def test_what_spoke_against_a_walker_is_made_up_for_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    judged: list[float] = []

    def log_odds(measures: dict[str, float]) -> float:
        judged.append(-4.0 if len(judged) < 12 else 4.0)
        return judged[-1]

    monkeypatch.setattr('gait_segmentation.starting.finder.log_odds', log_odds)
    finder = WalkerFinder(small_bank())
    for number, image in enumerate(walk()):
        if finder.update(image, 10**9 + number * PERIOD_NS):
            break
    assert 1 <= judged.count(4.0) <= 4


def test_who_is_on_trial_is_looked_at_but_not_found() -> None:
    finder = WalkerFinder(small_bank())
    tried: list[Box] = []
    evidence: list[float] = []
    for frame in clip(pan=0.0, frames=40):
        found = finder.update(frame.image, frame.stamp_ns, tried=tried)
        assert not (found and tried)
        if found or tried:
            tried = [box_of(frame)]
            evidence.append(finder.evidence(tried[0]))
    assert evidence[-1] > 3 * evidence[0] >= 3
    assert finder.evidence(Box(0, 0, 20, 40)) == 0


def test_after_an_error_more_evidence_is_asked_for() -> None:
    finder = WalkerFinder(small_bank())
    wrong: list[int] = []
    for number, frame in enumerate(clip(pan=0.0, frames=40)):
        for box in finder.update(frame.image, frame.stamp_ns):
            assert finder.evidence(box) >= (10 if wrong else 1)
            finder.refute(box)
            assert finder.evidence(box) == 0
            wrong.append(number)
    assert len(wrong) == 2
    assert wrong[1] - wrong[0] > 5


def test_who_is_matched_is_told_whether_found_or_not() -> None:
    finder = WalkerFinder(small_bank(), StartingConfig(least_evidence=100.0))
    told: list[Box] = []
    for frame in clip(pan=0.0, frames=20):
        assert finder.update(frame.image, frame.stamp_ns) == []
        told += [box for box, _ in finder.judged() if box.iou(box_of(frame)) > 0.6]
    assert len(told) > 3


PERIOD = 0.04


def moving(x: float, y: float = 20.0, width: float = 20.0, height: float = 60.0) -> Blob:
    return Blob(Box(x, y, width, height), 900, 600)


def followed(frames: int, step: float, pan: float = 0.0) -> list[Candidate]:
    """Follow one blob that moves by ``step`` against the world and ``-pan`` with the canvas."""
    candidates: list[Candidate] = []
    x = 20.0
    for number in range(frames):
        seconds = 1 + number * PERIOD
        for each in candidates:
            each.box = each.box.shifted(-pan, 0)
        candidates = follow(candidates, [moving(x)], seconds, 24)
        x += step - pan
    return candidates


@pytest.mark.parametrize('pan', [0.0, 2.0])
def test_a_blob_is_followed(pan: float) -> None:
    (candidate,) = followed(20, 2.0, pan)
    assert candidate.sightings == 20


def test_two_blobs_are_not_confused() -> None:
    candidates: list[Candidate] = []
    for number in range(10):
        blobs = [moving(20 + 2 * number), moving(120 - 2 * number)]
        candidates = follow(candidates, blobs[:: (-1) ** number], 1 + number * PERIOD, 24)
    assert [each.sightings for each in candidates] == [10, 10]
    assert candidates[0].speed[0] > 0 > candidates[1].speed[0]


def test_a_lost_blob_is_dropped_after_a_while() -> None:
    candidates = followed(10, 2.0)
    assert follow(candidates, [], 1 + 12 * PERIOD, 24) == candidates
    assert follow(candidates, [], 1 + 20 * PERIOD, 24) == []


@pytest.mark.parametrize(
    'unlikely',
    [moving(20, height=20), moving(20, width=90), Blob(Box(20, 20, 20, 60), 900, 10)],
    ids=['small', 'wide', 'still'],
)
def test_what_is_small_wide_or_still_is_not_followed(unlikely: Blob) -> None:
    assert follow([], [unlikely], 1.0, 24) == []


def test_the_number_of_candidates_is_bounded() -> None:
    blobs = [moving(30 * number) for number in range(50)]
    assert len(follow([], blobs, 1.0, 24)) == 24


def test_a_shape_is_the_same_at_any_size_and_aspect() -> None:
    region = np.zeros((48, 24), np.uint8)
    region[:, 6:18] = region[10:20] = 255
    shape = normalised(region)
    assert shape.shape == (24, 48)
    for other in (normalised(region.repeat(3, axis=0).repeat(3, axis=1)),
                  normalised(region.repeat(2, axis=1), 0.5)):  # fmt: skip
        assert tanimoto(shape, other) == pytest.approx(1, abs=0.03)


def test_what_is_wider_than_twice_its_height_has_no_shape() -> None:
    assert normalised(np.full((10, 30), 255, np.uint8)) is None


def test_a_walker_is_more_like_a_body_than_a_box_is() -> None:
    shapes, frame = BodyShapes(small_bank()), clip(pan=0.0, frames=40)[20]
    rows, columns = box_of(frame).slices(*frame.masks[0].shape[::-1])
    walker = normalised(frame.masks[0][rows, columns])
    box = normalised(np.full((60, 24), 255, np.uint8))
    assert shapes.likeness(walker) > 0.7 > shapes.likeness(box)


MODEL = json.loads(MODEL_FILE.read_text(encoding='utf-8'))


def extreme(side: int) -> dict[str, float]:
    """Return the measures that speak most for (1) or against (-1) a walker."""
    values: dict[str, list[float]] = {}
    for name, _, low, high in MODEL['rows']:
        values.setdefault(name, []).extend((low, high))
    best = {}
    for name, bends in values.items():
        rows = [row[1:] for row in MODEL['rows'] if row[0] == name]
        told = {
            value: side * sum(weight * min(max(value, low), high) for weight, low, high in rows)
            for value in bends
        }
        best[name] = max(told, key=lambda value: told[value])
    return best


def test_one_frame_says_little_either_way() -> None:
    assert 2 < log_odds(extreme(1)) <= 4
    assert log_odds(extreme(-1)) == -4


def test_what_is_more_than_usual_counts_as_usual() -> None:
    usual = extreme(1)
    most = max(high for name, _, _, high in MODEL['rows'] if name == 'similarity')
    assert log_odds(usual | {'similarity': most}) == log_odds(usual | {'similarity': most + 1})


def test_who_resembles_a_template_walks() -> None:
    assert all(weight > 0 for name, weight, _, _ in MODEL['rows'] if name == 'similarity')
