# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.paper.features import (
    POOL,
    FeatureModel,
    FeatureSelector,
    Pixels,
    class_histograms,
)

COLOURS = np.zeros((8, 12, 3), np.uint8)
COLOURS[:, :4] = (200, 100, 50)
COLOURS[:, 4:8] = (100, 50, 25)
COLOURS[:, 8:] = (90, 90, 90)


def test_the_shares_of_green_and_red_are_those_in_the_sum_of_the_three() -> None:
    (feature,) = (each for each in POOL if each.name == 'rg')
    places = feature.places(Pixels(COLOURS, COLOURS[..., 0]))
    # Of the upper five bits each, whatever the brightness.
    blue = (255 * 2 // 7 // 8) << 5 | (255 // 7 // 8)
    grey = (255 // 3 // 8) << 5 | (255 // 3 // 8)
    np.testing.assert_array_equal(places, np.tile(np.repeat([blue, blue, grey], 4), (8, 1)))


def test_the_orientation_is_that_of_gradients_whichever_side_is_lighter() -> None:
    (feature,) = (each for each in POOL if each.name == 'orientation')
    y, x = np.mgrid[:12, :12]
    # Across, down to the right, down, down to the left, and none.
    for gray, place in (
        (20 * x, 1),
        (10 * (x + y), 8),
        (20 * y, 16),
        (10 * (11 + y - x), 24),
        (0 * x, 0),
    ):
        for each in (gray, 255 - gray):
            plane = each.astype(np.uint8)
            found = feature.places(Pixels(cv2.merge([plane] * 3), plane))
            assert np.all(found[3:-3, 3:-3] == place)


LABELS = np.array([[1, 1, 0, 0, 2]], np.uint8)


def histograms(*values: int, has_neutral: bool = False) -> np.ndarray:
    places = np.array([values], np.uint16) >> 3
    return class_histograms(places, LABELS, 32, has_neutral=has_neutral)


def test_the_variance_ratio_is_the_formula() -> None:
    found = histograms(10, 60, 60, 200, 0)
    model = FeatureModel(32, has_neutral=False)
    model.adapt(found)
    table = model.table[np.array([10, 60, 60, 200]) >> 3].astype(float)
    p, q = table[:2], table[2:]
    expected = np.var(table) / (np.var(p) + np.var(q) + 0.05)
    assert model.variance_ratio(found) == pytest.approx(expected)
    assert model.variance_ratio(found[::-1]) == 0


def test_a_model_that_became_another_falls_back_to_the_first() -> None:
    model, same = FeatureModel(32, has_neutral=False), FeatureModel(32, has_neutral=False)
    first = histograms(10, 10, 200, 200, 0)
    model.adapt(first)
    before = model.table.copy()
    # Nothing of the first colour is left: the current histogram is not believed.
    model.adapt(histograms(100, 100, 200, 200, 0))
    assert np.array_equal(model.table, before)
    same.adapt(first)
    same.adapt(histograms(10, 100, 200, 200, 0))
    similarity = np.sqrt(0.5)
    assert same.table[100 >> 3] == pytest.approx(np.log(0.5 * similarity / 1e-3))


SHAPE = (60, 80)
CLASSES = np.zeros(SHAPE, np.uint8)
CLASSES[6:54, 26:54] = 2
CLASSES[10:50, 30:50] = 1


def coloured(person: tuple[int, int, int], around: tuple[int, int, int]) -> Pixels:
    rng = np.random.default_rng(0)
    bgr = np.where(CLASSES[..., None] > 0, np.uint8(person), np.uint8(around))
    bgr = np.uint8(np.clip(bgr + rng.normal(0, 2, bgr.shape), 0, 255))
    return Pixels(bgr, cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY))


def test_the_likelihood_is_made_of_what_separates_best() -> None:
    selector, seen = FeatureSelector(), coloured((60, 60, 160), (60, 60, 90))
    selector.rank(seen, CLASSES)
    found = {feature.name: feature for feature in selector.features}
    assert found['RGB'].variance_ratio > 5
    assert found['orientation'].weight == 0
    ratios = [feature.variance_ratio for feature in selector.features]
    assert ratios == sorted(ratios, reverse=True)
    weights = [feature.weight for feature in selector.features]
    assert sum(weights) == pytest.approx(1)
    assert min(weights[:3]) > max(weights[3:]) == 0
    logit = selector.log_ratio(seen)
    assert logit[30, 40] > 3
    assert logit[30, 10] < -3


def test_it_is_chosen_anew_as_the_surroundings_change() -> None:
    selector, person = FeatureSelector(), (60, 60, 160)
    ranks = []
    # Of another lightness, which chromaticity does not tell, and then of another colour.
    for around in ((22, 22, 60), (160, 60, 60)):
        selector.rank(coloured(person, around), CLASSES)
        names = [each.name for each in selector.features]
        ranks.append(names.index('rg') - names.index('RGB'))
    assert ranks[0] > 0
    assert ranks[1] != ranks[0]


def test_nothing_is_learnt_of_what_is_too_little_like_the_person_at_first() -> None:
    selector, other = FeatureSelector(), coloured((160, 60, 60), (60, 60, 90))
    selector.rank(coloured((60, 60, 160), (60, 60, 90)), CLASSES)
    before, ranked = selector.log_ratio(other), selector.features
    selector.rank(other, CLASSES)
    assert selector.features == ranked
    assert np.array_equal(selector.log_ratio(other), before)


def test_nothing_learnt_says_nothing() -> None:
    seen = coloured((9, 9, 9), (90, 90, 90))
    assert not FeatureSelector().log_ratio(seen).any()
    selector = FeatureSelector()
    selector.rank(seen, np.zeros(SHAPE, np.uint8))
    assert not selector.log_ratio(seen).any()
