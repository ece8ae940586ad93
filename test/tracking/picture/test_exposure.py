# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.tracking.picture.exposure import Exposure


def scene(seed: int = 1) -> np.ndarray:
    small = np.random.default_rng(seed).integers(60, 180, (12, 16)).astype(np.uint8)
    return cv2.resize(small, (320, 240), interpolation=cv2.INTER_CUBIC)


@pytest.mark.parametrize('factor', [0.5, 0.8, 1.3])
def test_a_jump_is_measured_and_the_way_back_too(factor: float) -> None:
    exposure = Exposure()
    assert exposure.update(Pyramid(scene())) == 1
    changed = cv2.convertScaleAbs(scene(), alpha=factor)
    assert exposure.update(Pyramid(changed)) == pytest.approx(1 / factor, rel=0.03)
    assert exposure.update(Pyramid(changed)) == pytest.approx(1 / factor, rel=0.03)
    assert exposure.update(Pyramid(scene())) == pytest.approx(1, rel=0.05)


def test_slow_changes_are_left_alone() -> None:
    exposure = Exposure()
    for number in range(20):
        assert exposure.update(Pyramid(cv2.convertScaleAbs(scene(), alpha=1 + 0.01 * number))) == 1


def test_other_pictures_and_moved_ones_are_no_jumps() -> None:
    exposure = Exposure()
    exposure.update(Pyramid(scene()))
    assert exposure.update(Pyramid(np.roll(scene(), 40, axis=1))) == 1
    assert exposure.update(Pyramid(scene(2))) == 1
    stripes = np.where(np.arange(320) // 4 % 2, 150, 90).astype(np.uint8)[None].repeat(240, 0)
    exposure.update(Pyramid(stripes))
    for step in range(1, 9):
        assert exposure.update(Pyramid(np.roll(stripes, step, axis=1))) == 1


@pytest.mark.parametrize('value', [0, 255])
def test_black_and_white_images_say_nothing(value: int) -> None:
    exposure = Exposure()
    exposure.update(Pyramid(scene()))
    assert exposure.update(Pyramid(np.full((240, 320), value, np.uint8))) == 1


def test_a_part_that_darkens_is_no_jump() -> None:
    image = np.random.default_rng(5).integers(60, 200, (96, 128)).astype(np.uint8)
    darker = image.copy()
    darker[:, :60] //= 2
    exposure = Exposure()
    exposure.update(Pyramid(image))
    assert exposure.update(Pyramid(darker)) == 1.0


def test_an_image_smaller_than_a_cell_says_nothing() -> None:
    exposure = Exposure()
    for value in (200, 50):
        assert exposure.update(Pyramid(np.full((5, 40), value, np.uint8))) == 1.0
