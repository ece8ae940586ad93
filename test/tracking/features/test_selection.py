# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.config import TrackingConfig
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
    selector, seen = FeatureSelector(TrackingConfig()), view((60, 60, 160), (60, 60, 90))
    selector.learn(seen, LABELS)
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
    selector, person = FeatureSelector(TrackingConfig()), (60, 60, 160)
    ranks = []
    # Of another lightness, which chromaticity does not tell, and then of another colour.
    for around in ((22, 22, 60), (160, 60, 60)):
        selector.learn(view(person, around), LABELS)
        names = [each.name for each in selector.features]
        ranks.append(names.index('rg') - names.index('RGB'))
    assert ranks[0] > 0
    assert ranks[1] != ranks[0]


def test_what_is_too_little_like_the_first_person_is_not_learnt() -> None:
    gated, open_gate = (FeatureSelector(TrackingConfig(drift_gate=gate)) for gate in (0.6, 0.0))
    first, other = view((60, 60, 160), (60, 160, 60)), view((160, 60, 60), (60, 60, 160))
    for selector in (gated, open_gate):
        selector.learn(first, LABELS)
        before = selector.log_ratio(first)
        selector.learn(other, LABELS)
        assert np.array_equal(selector.log_ratio(first), before) == (selector is gated)


def test_as_many_features_as_set_are_chosen() -> None:
    selector = FeatureSelector(TrackingConfig(chosen_features=2))
    selector.learn(view((60, 60, 160), (60, 60, 90)), LABELS)
    assert sum(each.weight > 0 for each in selector.features) == 2


def test_nothing_learnt_says_nothing() -> None:
    seen = view((9, 9, 9), (90, 90, 90))
    assert not FeatureSelector(TrackingConfig()).log_ratio(seen).any()
    selector = FeatureSelector(TrackingConfig())
    selector.learn(seen, np.zeros(SHAPE, np.uint8))
    assert not selector.log_ratio(seen).any()
