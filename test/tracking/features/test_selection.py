# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.features import FeatureSelector, View

SHAPE = (60, 80)
LABELS = np.zeros(SHAPE, np.uint8)
LABELS[6:54, 26:54] = 2
LABELS[10:50, 30:50] = 1


def view(person: tuple[int, int, int], around: tuple[int, int, int]) -> View:
    rng = np.random.default_rng(0)
    bgr = np.where(LABELS[..., None] > 0, np.uint8(person), np.uint8(around))
    bgr = np.uint8(np.clip(bgr + rng.normal(0, 2, bgr.shape), 0, 255))
    return View(bgr, cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY))


def test_the_likelihood_is_made_of_what_separates_best() -> None:
    selector, seen = FeatureSelector(), view((60, 60, 160), (60, 60, 90))
    selector.learn(seen, LABELS)
    found = {feature.name: feature for feature in selector.features}
    assert found['R'].variance_ratio > 5
    assert found['B'].weight == 0
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
    for around in ((60, 60, 90), (130, 60, 160)):
        selector.learn(view(person, around), LABELS)
        names = [each.name for each in selector.features]
        ranks.append(names.index('R') - names.index('B'))
    assert ranks[0] < 0 < ranks[1]


def test_nothing_learnt_says_nothing() -> None:
    seen = view((9, 9, 9), (90, 90, 90))
    assert not FeatureSelector().log_ratio(seen).any()
    selector = FeatureSelector()
    selector.learn(seen, np.zeros(SHAPE, np.uint8))
    assert not selector.log_ratio(seen).any()
