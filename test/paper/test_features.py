# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.paper.features import (
    NEUTRAL,
    POOL,
    FeatureModel,
    FeatureSelector,
    View,
    class_histograms,
)

NAMED = {feature.name: feature for feature in POOL}
COLOURS = np.zeros((8, 12, 3), np.uint8)
COLOURS[:, :4] = (200, 100, 50)
COLOURS[:, 4:8] = (100, 50, 25)
COLOURS[:, 8:] = (90, 90, 90)


def view(bgr: np.ndarray, step: int = 1) -> View:
    return View(bgr, cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY), step=step)


def places(name: str, seen: View) -> np.ndarray:
    return NAMED[name].places(seen)


def orientation(seen: View) -> np.ndarray:
    return NAMED['orientation'].planes(seen)[0]


@pytest.mark.parametrize('name', list(NAMED))
@pytest.mark.parametrize('step', [1, 2])
def test_places_are_bins_of_the_pixels_needed(name: str, step: int) -> None:
    result = places(name, view(COLOURS, step))
    assert result.dtype == np.uint16
    assert result.max() < NAMED[name].bins
    assert np.array_equal(result, places(name, view(COLOURS))[::step, ::step])


def test_a_bin_holds_the_highest_bits_of_every_plane() -> None:
    blue, green, red = (int(value) >> 5 for value in COLOURS[0, 0])
    assert places('RGB', view(COLOURS))[0, 0] == (blue << 6) + (green << 3) + red


def test_chromaticity_does_not_depend_on_brightness() -> None:
    result = places('rg', view(COLOURS))
    assert result[0, 0] == result[0, 5] != result[0, 10]


@pytest.mark.parametrize('shape', [(40, 53), (3, 3), (7, 2)])
@pytest.mark.parametrize('step', [1, 2])
def test_orientation_is_that_of_the_structure_tensor(shape: tuple[int, int], step: int) -> None:
    rng = np.random.default_rng(2)
    gray = cv2.GaussianBlur(rng.integers(0, 256, shape, np.uint8), (0, 0), 0.7)
    dx = cv2.Sobel(gray, cv2.CV_64F, 1, 0, ksize=3, scale=1 / 8)
    dy = cv2.Sobel(gray, cv2.CV_64F, 0, 1, ksize=3, scale=1 / 8)
    real, imaginary = (cv2.blur(part, (5, 5)) for part in (dx * dx - dy * dy, 2 * dx * dy))
    expected = 8 + 247 * (np.arctan2(imaginary, real) / (2 * np.pi) % 1)
    expected[np.hypot(real, imaginary) < 150] = NEUTRAL
    seen = View(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR), gray, step=step)
    off = np.abs(orientation(seen) - expected[::step, ::step])
    assert np.all(np.minimum(off, 247 - off) <= 1.1)


LABELS = np.array([[1, 1, 0, 0, 2]], np.uint8)


def histograms(*values: int, has_neutral: bool = False) -> np.ndarray:
    places = np.array([values], np.uint16) >> 3
    return class_histograms(places, LABELS, 32, has_neutral=has_neutral)


@pytest.mark.parametrize('has_neutral', [False, True])
def test_pixels_count_in_their_class_only_and_neutral_ones_not_at_all(has_neutral: bool) -> None:
    found = histograms(0, 255, 8, 15, 100, has_neutral=has_neutral)
    expected = np.zeros((2, 32))
    expected[0, 1], expected[1, [0, 31]] = 1, (0.5 * (not has_neutral), 0.5)
    np.testing.assert_array_equal(found, expected)


def test_ratios_are_those_of_the_densities() -> None:
    model = FeatureModel(32, has_neutral=False)
    assert np.all(model.table == 0)
    model.learn(histograms(0, 100, 0, 200, 0))
    assert model.table[0] == pytest.approx(0, abs=1e-6)
    assert model.table[100 >> 3] == pytest.approx(np.log(0.5 / 1e-3))
    assert model.table[200 >> 3] == pytest.approx(-np.log(0.5 / 1e-3))
    ratio = model.table[np.array([[100, 101]], np.uint16) >> 3]
    assert ratio == pytest.approx(np.full((1, 2), np.log(500)))


def test_the_variance_ratio_is_the_formula() -> None:
    found = histograms(10, 60, 60, 200, 0)
    model = FeatureModel(32, has_neutral=False)
    model.learn(found)
    table = model.table[np.array([10, 60, 60, 200]) >> 3].astype(float)
    p, q = table[:2], table[2:]
    expected = np.var(table) / (np.var(p) + np.var(q) + 0.05)
    assert model.variance_ratio(found) == pytest.approx(expected)
    assert model.variance_ratio(found[::-1]) == 0


def test_without_one_class_nothing_is_told_apart() -> None:
    model = FeatureModel(32, has_neutral=False)
    model.learn(histograms(0, 0, 255, 255, 0))
    none = class_histograms(
        np.zeros((1, 5), np.uint16), np.ones((1, 5), np.uint8), 32, has_neutral=False
    )
    assert model.variance_ratio(none) == 0


def test_a_model_that_became_another_falls_back_to_the_first() -> None:
    model, same = FeatureModel(32, has_neutral=False), FeatureModel(32, has_neutral=False)
    first = histograms(10, 10, 200, 200, 0)
    model.learn(first)
    before = model.table.copy()
    # Nothing of the first colour is left: the current histogram is not believed.
    model.learn(histograms(100, 100, 200, 200, 0))
    assert np.array_equal(model.table, before)
    same.learn(first)
    same.learn(histograms(10, 100, 200, 200, 0))
    similarity = np.sqrt(0.5)
    assert same.table[100 >> 3] == pytest.approx(np.log(0.5 * similarity / 1e-3))


SHAPE = (60, 80)
CLASSES = np.zeros(SHAPE, np.uint8)
CLASSES[6:54, 26:54] = 2
CLASSES[10:50, 30:50] = 1


def coloured(person: tuple[int, int, int], around: tuple[int, int, int]) -> View:
    rng = np.random.default_rng(0)
    bgr = np.where(CLASSES[..., None] > 0, np.uint8(person), np.uint8(around))
    bgr = np.uint8(np.clip(bgr + rng.normal(0, 2, bgr.shape), 0, 255))
    return View(bgr, cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY))


def test_the_likelihood_is_made_of_what_separates_best() -> None:
    selector, seen = FeatureSelector(), coloured((60, 60, 160), (60, 60, 90))
    selector.learn(seen, CLASSES)
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
        selector.learn(coloured(person, around), CLASSES)
        names = [each.name for each in selector.features]
        ranks.append(names.index('rg') - names.index('RGB'))
    assert ranks[0] > 0
    assert ranks[1] != ranks[0]


def test_nothing_learnt_says_nothing() -> None:
    seen = coloured((9, 9, 9), (90, 90, 90))
    assert not FeatureSelector().log_ratio(seen).any()
    selector = FeatureSelector()
    selector.learn(seen, np.zeros(SHAPE, np.uint8))
    assert not selector.log_ratio(seen).any()
