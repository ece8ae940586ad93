# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.scene.contrast import Contrast, contrast_curve


def picture(low: int, high: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).integers(low, high + 1, (60, 80, 3)).astype(np.uint8)


def spread_of(image: np.ndarray) -> np.ndarray:
    curve = Contrast().curve_for(image)
    assert curve is not None
    return curve[image]


@pytest.mark.parametrize(('low', 'high'), [(0, 255), (20, 230), (50, 185)])
def test_pictures_that_use_many_levels_stay_as_they_are(low: int, high: int) -> None:
    image = picture(low, high)
    assert contrast_curve(image) is None
    assert Contrast().curve_for(image) is None


@pytest.mark.parametrize(('low', 'high'), [(0, 70), (80, 160), (190, 255)])
def test_the_levels_of_flat_pictures_are_spread(low: int, high: int) -> None:
    spread = spread_of(picture(low, high))
    assert int(spread.max()) - int(spread.min()) >= 120


def test_black_stays_black_and_white_stays_white() -> None:
    assert spread_of(picture(0, 70)).min() == 0
    assert spread_of(picture(190, 255)).max() == 255


@pytest.mark.parametrize('level', [0, 128, 255])
def test_a_picture_of_one_level_decides_nothing(level: int) -> None:
    assert contrast_curve(np.full((8, 8, 3), level, np.uint8)) is None


def test_no_order_of_levels_changes_and_none_is_lost_at_the_ends() -> None:
    curve = contrast_curve(picture(100, 140))
    assert curve is not None
    assert curve[0] == 0
    assert curve[255] == 255
    assert (np.diff(curve.astype(int)) >= 0).all()
    # What is brighter than all that was seen at first can still be told apart.
    assert curve[255] > curve[200] > curve[150]


def test_levels_that_count_are_spread_evenly_and_the_rest_keeps_its_shares() -> None:
    curve = contrast_curve(np.repeat(np.arange(100, 141, dtype=np.uint8), 9).reshape(-1, 9, 1))
    assert curve is not None
    # 40 levels become 128; of the 127 left 100 / 215 lie below.
    expected = 127 * 100 / 215 + 3.2 * np.arange(41)
    assert curve[100:141] == pytest.approx(expected, abs=0.51)
    assert curve[50] == pytest.approx(127 * 50 / 215, abs=0.51)


def test_the_first_picture_decides_for_all_that_follow() -> None:
    contrast = Contrast()
    first = contrast.curve_for(picture(40, 100))
    assert np.array_equal(first, contrast_curve(picture(40, 100)))
    later = picture(0, 255, 2)
    assert contrast.curve_for(later) is first
    contrast = Contrast()
    contrast.curve_for(later)
    assert contrast.curve_for(picture(40, 100)) is None
