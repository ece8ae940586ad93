# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.lab import gray_lab, is_gray


def test_one_coloured_pixel_makes_a_colour_image() -> None:
    image = np.repeat(np.arange(24, dtype=np.uint8).reshape(4, 6, 1), 3, axis=2)
    assert is_gray(image)
    for channel in range(3):
        tinted = image.copy()
        tinted[3, 5, channel] += 1
        assert not is_gray(tinted)


def test_brightness_is_that_of_lab() -> None:
    gray = np.random.default_rng(0).integers(0, 256, (20, 30)).astype(np.uint8)
    lab = cv2.cvtColor(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR), cv2.COLOR_BGR2Lab)
    assert np.array_equal(gray_lab(gray)[..., 0], lab[..., 0])


def test_stripes_are_told_from_an_even_area_and_by_their_direction() -> None:
    gray = np.full((40, 90), 100, np.uint8)
    gray[:, :30] += (np.arange(30, dtype=np.uint8) // 2 % 2) * 60
    gray[:, 30:60] += (np.arange(40, dtype=np.uint8) // 2 % 2)[:, None] * 60
    upright, level, even = (
        gray_lab(gray)[10:30, x : x + 20, 1:].mean((0, 1)) for x in (5, 35, 65)
    )
    assert upright[0] > even[0] + 5
    assert level[1] > even[1] + 5
    assert upright[1] == pytest.approx(even[1], abs=0.5)
    assert level[0] == pytest.approx(even[0], abs=0.5)
