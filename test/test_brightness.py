# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import numpy as np
import pytest

from gait_segmentation.brightness import brightening

BEFORE = np.random.default_rng(1).uniform(60, 120, (40, 50)).astype(np.float32)
LIMITS = (20, 240)


@pytest.mark.parametrize('factor', [0.7, 1.0, 1.6])
def test_the_factor_of_most_pixels_is_measured_though_a_part_changed_otherwise(
    factor: float,
) -> None:
    now = factor * BEFORE
    now[:, :10] = BEFORE[:, :10] * 0.5
    found = brightening(now, BEFORE, LIMITS, 0.05)
    assert found.log == pytest.approx(math.log(factor), abs=1e-5)
    assert found.share == pytest.approx(0.8)
    assert found.pixels == 2000


def test_images_of_whole_numbers_are_compared_as_well() -> None:
    before = BEFORE.astype(np.uint8)
    assert brightening(2 * before, before, LIMITS, 0.05).log == pytest.approx(math.log(2))


def test_what_is_too_dark_or_too_bright_in_either_image_does_not_count() -> None:
    now, before = BEFORE.copy(), BEFORE.copy()
    now[:10], before[10:20], now[20:25], before[25:30] = 20, 20, 240, 240
    assert brightening(now, before, LIMITS, 0.05) == (0.0, 1.0, 500)


def test_where_nothing_can_be_compared_nothing_is_said() -> None:
    black = np.zeros((4, 4), np.uint8)
    assert brightening(black, black, LIMITS, 0.05) == (0.0, 0.0, 0)
