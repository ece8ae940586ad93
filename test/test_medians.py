# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of :mod:`gait_segmentation.medians`: as NumPy has them."""

from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.medians import median, quantiles


@pytest.mark.parametrize('count', [1, 2, 7, 50])
def test_medians_and_quantiles_are_those_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).normal(size=(count, 3)).astype(np.float32)
    np.testing.assert_array_equal(median(values), np.median(values, axis=0))
    assert median(values[:, 0]) == np.median(values[:, 0])
    shares = (0.005, 0.5, 0.995)
    assert quantiles(values[:, 0], shares) == pytest.approx(np.quantile(values[:, 0], shares))
