# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.tracking.features.histograms import (
    ChannelModel,
    class_histograms,
    pixels_ratio,
)

LABELS = np.array([[1, 1, 0, 0, 2]], np.uint8)


def histograms(*values: int, has_neutral: bool = False) -> np.ndarray:
    return class_histograms(np.array([values], np.uint8), LABELS, has_neutral=has_neutral)


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
    model = ChannelModel(has_neutral=False)
    assert np.all(model.table == 0)
    model.learn(histograms(0, 100, 0, 200, 0), 0.1)
    assert model.table[0] == pytest.approx(0, abs=1e-6)
    assert model.table[100 >> 3] == pytest.approx(np.log(0.5 / 1e-3))
    assert model.table[200 >> 3] == pytest.approx(-np.log(0.5 / 1e-3))
    ratio = model.log_ratio(np.array([[100, 101]], np.uint8))
    assert ratio == pytest.approx(np.full((1, 2), np.log(500)))


def test_the_variance_ratio_is_the_formula() -> None:
    rng = np.random.default_rng(0)
    logit = rng.normal(0, 1, (40, 50)).astype(np.float32)
    labels = np.zeros((40, 50), np.uint8)
    labels[:, 30:] = 1
    logit[:, 30:] += 2
    p, q = logit[:, 30:], logit[:, :30]
    mean, square = (p.mean() + q.mean()) / 2, ((p**2).mean() + (q**2).mean()) / 2
    expected = (square - mean**2) / (p.var() + q.var() + 0.05)
    assert pixels_ratio(logit, labels) == pytest.approx(expected, rel=1e-3)
    assert pixels_ratio(-logit, labels) == 0


def test_without_one_class_nothing_is_told_apart() -> None:
    assert pixels_ratio(np.ones((2, 2), np.float32), np.ones((2, 2), np.uint8)) == 0
    model = ChannelModel(has_neutral=False)
    model.learn(histograms(0, 0, 255, 255, 0), 0.1)
    none = class_histograms(
        np.zeros((1, 5), np.uint8), np.ones((1, 5), np.uint8), has_neutral=False
    )
    assert model.variance_ratio(none) == 0


def test_a_separating_channel_has_the_larger_ratio() -> None:
    good, poor = ChannelModel(has_neutral=False), ChannelModel(has_neutral=False)
    apart, alike = histograms(10, 10, 200, 200, 0), histograms(10, 200, 10, 200, 0)
    good.learn(apart, 0.1)
    poor.learn(alike, 0.1)
    assert good.variance_ratio(apart) > 10 * poor.variance_ratio(alike)


def test_a_model_that_became_another_falls_back_to_the_first() -> None:
    model = ChannelModel(has_neutral=False)
    model.learn(histograms(10, 10, 200, 200, 0), 0.1)
    for _ in range(60):
        model.learn(histograms(100, 100, 200, 200, 0), 0.1)
    # Nothing of the first colour is left: the current model is not believed.
    assert model.similarity < 0.1
    assert model.table[10 >> 3] > 5
    assert model.table[100 >> 3] < model.table[10 >> 3] - 2
    same = ChannelModel(has_neutral=False)
    for _ in range(60):
        same.learn(histograms(10, 12, 200, 200, 0), 0.1)
    assert same.similarity == pytest.approx(1)
