# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.errors import InputError
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.results import FeatureWeight
from gait_segmentation.tracking import PeopleTracker, TrackingConfig
from gait_segmentation.tracking.features import STEP, FeatureSelector, View
from gait_segmentation.tracking.features.selection import labels_of
from test.walkers import box_of, overlap, small_bank

SHAPE = (60, 80)
MASK = np.zeros(SHAPE, np.uint8)
MASK[10:50, 30:50] = 255
THIN = np.zeros((30, 40), np.float32)


def view(person: tuple[int, int, int], around: tuple[int, int, int]) -> View:
    rng = np.random.default_rng(0)
    bgr = np.where(MASK[..., None] > 0, np.uint8(person), np.uint8(around))
    bgr = np.uint8(np.clip(bgr + rng.normal(0, 2, bgr.shape), 0, 255))
    return View(bgr, cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY))


def evidence() -> dict[str, np.ndarray]:
    return {'colour': THIN, 'background': THIN, 'motion': THIN}


def by_name(selector: FeatureSelector) -> dict[str, FeatureWeight]:
    return {feature.name: feature for feature in selector.features}


def test_what_separates_joins_a_poor_likelihood() -> None:
    selector = FeatureSelector()
    seen = view((60, 60, 160), (60, 60, 90))
    selector.learn(seen, MASK, 0.15)
    logit = np.zeros(SHAPE, np.float32)
    selector.add(logit, seen, MASK, evidence)
    found = by_name(selector)
    assert found['R'].variance_ratio > 5
    assert found['R'].weight > 0
    assert found['B'].weight == 0
    assert logit[30, 40] > 3
    assert logit[30, 10] < -3
    # Best first, and those that are always used have their weight.
    ratios = [feature.variance_ratio for feature in selector.features]
    assert ratios == sorted(ratios, reverse=True)
    assert found['colour'].weight == found['background'].weight == 1


def test_a_feature_that_says_the_same_does_not_count_twice() -> None:
    selector = FeatureSelector()
    seen = view((160, 160, 160), (90, 90, 90))
    selector.learn(seen, MASK, 0.15)
    selector.add(np.zeros(SHAPE, np.float32), seen, MASK, evidence)
    found = by_name(selector)
    assert min(found[name].variance_ratio for name in 'RGB') > 5
    assert sum(found[name].weight > 0 for name in 'RGB') == 1


def test_a_good_likelihood_is_left_alone() -> None:
    selector = FeatureSelector()
    seen = view((60, 60, 160), (60, 60, 90))
    selector.learn(seen, MASK, 0.15)
    rng = np.random.default_rng(1)
    good = np.where(MASK > 0, 4, -4) + rng.normal(0, 0.2, SHAPE)
    logit = good.astype(np.float32)
    selector.add(logit, seen, MASK, evidence)
    assert np.array_equal(logit, good.astype(np.float32))
    assert by_name(selector)['R'].weight == 0


def test_the_choice_stays_while_the_person_is_not_seen() -> None:
    selector = FeatureSelector()
    seen = view((60, 60, 160), (60, 60, 90))
    selector.learn(seen, MASK, 0.15)
    first = np.zeros(SHAPE, np.float32)
    selector.add(first, seen, MASK, evidence)
    again = np.zeros(SHAPE, np.float32)
    selector.add(again, seen, None, evidence)
    assert np.array_equal(first, again)


def test_nothing_learnt_chooses_nothing() -> None:
    selector = FeatureSelector()
    logit = np.zeros(SHAPE, np.float32)
    selector.add(logit, view((9, 9, 9), (9, 9, 9)), MASK, evidence)
    assert np.all(logit == 0)


def test_a_heat_map_is_one_more_feature() -> None:
    selector = FeatureSelector()
    plain = view((90, 90, 90), (90, 90, 90))
    selector.learn(plain, MASK, 0.15)
    logit = np.zeros(SHAPE, np.float32)
    hot = np.where(MASK > 0, 230, 20).astype(np.uint8)
    selector.add(logit, replace(plain, heat=hot), MASK, evidence)
    assert selector.features[0].name == 'heat map'
    assert selector.features[0].weight > 1
    assert logit[30, 40] > 2
    assert logit[30, 10] < -2
    # Without it nothing of it is left.
    logit[:] = 0
    selector.add(logit, plain, MASK, evidence)
    assert np.all(logit == 0)


def stripes(size: tuple[int, int], horizontal: bool) -> np.ndarray:
    y, x = np.mgrid[0 : size[0], 0 : size[1]].astype(np.float32)
    wave = np.sin(2 * np.pi * (y if horizontal else x) / 8)
    return np.repeat((90 + 60 * (wave > 0))[..., None], 3, 2)


def hued(size: tuple[int, int], a: float, b: float) -> np.ndarray:
    """Return a surface of any lightness, the chroma following it: only the hue is constant."""
    rng = np.random.default_rng(int(a + 100))
    coarse = rng.standard_normal((size[0] // 6, size[1] // 6)).astype(np.float32)
    light = np.clip(120 + 25 * cv2.resize(coarse, size[::-1]), 30, 220)
    lab = np.stack([light, 128 + a * light / 120, 128 + b * light / 120], 2)
    return cv2.cvtColor(np.uint8(np.clip(lab, 0, 255)), cv2.COLOR_Lab2BGR).astype(np.float32)


SURFACES = {
    'texture': (stripes((400, 900), False), stripes((400, 900), True)),
    'hue': (hued((400, 900), 14, 10), hued((400, 900), -10, 14)),
}


def camouflaged(kind: str, use: bool) -> tuple[list[float], tuple[FeatureWeight, ...]]:
    """Track a walker dressed like the panned wall but for one property; return J by frame."""
    surroundings, cloth = SURFACES[kind]
    config = TrackingConfig(use_feature_selection=use)
    pipeline = Pipeline(PipelineConfig(tracking=config), bank=small_bank())
    clip = SyntheticSequence(SyntheticConfig(seed=3, frames=14, person_height=110.0))
    box = clip.initial_box
    assert box is not None
    pipeline.initialize(box)
    rng = np.random.default_rng(0)
    scores = []
    features: tuple[FeatureWeight, ...] = ()
    for frame in clip:
        here = box_of(frame)
        height, width = frame.masks[0].shape
        shift = (round(here.center_y), round(here.center_x))
        dress = np.roll(cloth, shift, (0, 1))[:height, :width]
        wall = surroundings[:height, 2 * frame.number : 2 * frame.number + width]
        image = np.where(frame.masks[0][..., None] > 0, dress, wall)
        image = np.clip(image + rng.normal(0, 2.5, image.shape), 0, 255).astype(np.uint8)
        person = pipeline.update(image, frame.stamp_ns)[0].people[0]
        scores.append(overlap(person.segmentation.mask, frame.truths[0]))
        features = person.track.features
    return scores, features


def test_somebody_of_the_same_colours_is_tracked_by_the_texture() -> None:
    scores, features = camouflaged('texture', True)
    assert np.mean(scores) > 0.8
    assert features[0].name == 'orientation'
    assert features[0].weight > 1
    without, none = camouflaged('texture', False)
    assert np.mean(without[-5:]) < 0.5
    assert none == ()


def test_the_tracker_takes_a_heat_map_of_any_size() -> None:
    tracker = PeopleTracker(small_bank())
    clip = SyntheticSequence(SyntheticConfig(seed=3, frames=2, person_height=110.0))
    box = clip.initial_box
    assert box is not None
    tracker.initialize(box)
    frame = clip.frame(0)
    heat = np.where(frame.masks[0][::2, ::2] > 0, 250, 10).astype(np.uint8)
    track = tracker.update(frame.image, frame.stamp_ns, heat)[0]
    ratios = {feature.name: feature.variance_ratio for feature in track.features}
    assert ratios['heat map'] > 1.5
    with pytest.raises(InputError, match='heat map'):
        tracker.update(frame.image, frame.stamp_ns + 1, heat.astype(np.float32))


def test_somebody_of_the_same_lightness_is_tracked_by_the_hue() -> None:
    scores, features = camouflaged('hue', True)
    assert np.mean(scores) > 0.9
    ratios = {feature.name: feature.variance_ratio for feature in features}
    assert min(ratios['colour'], ratios['r'], ratios['H']) > 3
    assert max(ratios['G'], ratios['orientation']) < 1
    assert ratios['r'] > 3 * max(ratios['R'], ratios['G'], ratios['B'])
    assert next(f.weight for f in features if f.name == 'colour') == pytest.approx(1)


def test_labels_leave_out_the_outline() -> None:
    rng = np.random.default_rng(3)
    for shape in ((31, 22), (2, 9)):
        mask = np.where(rng.random(shape) < 0.7, 255, 0).astype(np.uint8)
        mask[5:25, 5:15] = 255
        thin, square = np.ascontiguousarray(mask[::STEP, ::STEP]), np.ones((3, 3), np.uint8)
        inner, outer = cv2.erode(thin, square) > 0, cv2.dilate(thin, square) > 0
        np.testing.assert_array_equal(labels_of(mask), np.where(inner, 1, np.where(outer, 2, 0)))
