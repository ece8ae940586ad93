# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.segmentation.config import SegmentationConfig
from gait_segmentation.segmentation.shape_prior import shape_terms

HEIGHT = 80


def template() -> np.ndarray:
    prior = np.zeros((100, 60), np.uint8)
    prior[10:90, 20:40] = 255
    return prior


def test_none_adds_nothing() -> None:
    assert not shape_terms(template(), HEIGHT, SegmentationConfig(prior='none')).some


def test_default_is_for_inside_and_against_outside() -> None:
    config = SegmentationConfig(template_weight=0.5)
    terms = shape_terms(template(), HEIGHT, config)
    assert terms.logit is not None
    assert terms.logit[50, 30] == pytest.approx(1.5)
    assert terms.logit[50, 0] == pytest.approx(-1.5)


def test_the_template_is_no_surer_inside_than_as_far_outside() -> None:
    terms = shape_terms(template(), HEIGHT, SegmentationConfig(template_slope=0.05))
    assert terms.logit is not None
    # Two pixels to either side of the outline.
    assert terms.logit[50, 21] == pytest.approx(-terms.logit[50, 18])


def test_an_empty_template_adds_nothing() -> None:
    terms = shape_terms(np.zeros((9, 9), np.uint8), HEIGHT, SegmentationConfig())
    assert terms.logit is None
