# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.tracking.features.histograms import FeatureModel, class_histograms

LABELS = np.array([[1, 1, 0, 0, 2]], np.uint8)


def histograms(*values: int, has_neutral: bool = False) -> np.ndarray:
    places = np.array([values], np.uint16) >> 3
    return class_histograms(places, LABELS, 32, has_neutral=has_neutral)


def test_pixels_count_in_their_class_only() -> None:
    found = histograms(0, 255, 8, 15, 100)
    assert found.shape == (2, 32)
    assert found[1, 0] == found[1, 31] == 0.5
    assert found[0, 1] == 1
    assert found.sum() == 2


def test_neutral_pixels_count_in_no_bin() -> None:
    found = histograms(0, 255, 8, 15, 100, has_neutral=True)
    assert found[1, 0] == 0
    assert found[1, 31] == 0.5


def test_ratios_are_those_of_the_densities() -> None:
    model = FeatureModel(32, has_neutral=False)
    assert np.all(model.table == 0)
    model.learn(histograms(0, 100, 0, 200, 0))
    assert model.table[0] == pytest.approx(0, abs=1e-6)
    assert model.table[100 >> 3] == pytest.approx(np.log(0.5 / 1e-3))
    assert model.table[200 >> 3] == pytest.approx(-np.log(0.5 / 1e-3))
    ratio = model.log_ratio(np.array([[100, 101]], np.uint16) >> 3)
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


def test_a_separating_feature_has_the_larger_ratio() -> None:
    good, poor = FeatureModel(32, has_neutral=False), FeatureModel(32, has_neutral=False)
    apart, alike = histograms(10, 10, 200, 200, 0), histograms(10, 200, 10, 200, 0)
    good.learn(apart)
    poor.learn(alike)
    assert good.variance_ratio(apart) > 10 * poor.variance_ratio(alike)


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
