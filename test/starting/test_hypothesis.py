# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.hypothesis import Hypothesis

SHAPE = (30, 20)
PART = (slice(4, 24), slice(3, 15))


def hypothesis() -> tuple[Hypothesis, np.ndarray]:
    """Return a hypothesis of three templates and these in the whole window."""
    rng = np.random.default_rng(1)
    whole = np.zeros((3, *SHAPE), np.uint8)
    whole[(slice(None), *PART)] = rng.integers(0, 256, (3, 20, 12))
    own = np.ascontiguousarray(whole[(slice(None), *PART)])
    numbers = np.ones(3, np.float32)
    return Hypothesis(0.0, 0.0, PART, own, numbers, numbers, numbers, numbers), whole


def test_similarity_counts_the_whole_window() -> None:
    laid, whole = hypothesis()
    likelihood = np.random.default_rng(2).random(SHAPE).astype(np.float32)
    image = np.round(255 * likelihood)
    expected = [np.minimum(each, image).sum() / np.maximum(each, image).sum() for each in whole]
    assert laid.similarities(likelihood) == pytest.approx(expected, rel=1e-5)
    assert laid.similarities(whole[1] / np.float32(255))[1] == 1


def test_nothing_is_alike_to_nothing() -> None:
    laid, _ = hypothesis()
    assert not laid.similarities(np.zeros(SHAPE, np.float32)).any()


def test_the_average_is_weighted_and_blurred() -> None:
    laid, whole = hypothesis()
    mean = laid.average(np.array([1, 3, 0], np.float32), SHAPE, 0.0)
    expected = (whole[0] + 3.0 * whole[1]) / 4 / 255
    assert mean.shape == SHAPE
    assert np.abs(mean - expected).max() < 0.02
    blurred = laid.average(np.array([1, 3, 0], np.float32), SHAPE, 2.0)
    assert blurred.std() < 0.9 * mean.std()
    assert blurred.sum() == pytest.approx(mean.sum(), rel=0.02)
