# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.scene.ego_motion.pyramid import Pyramid


def test_each_level_has_the_means_of_four_pixels_of_the_one_before() -> None:
    gray = np.random.default_rng(0).integers(0, 256, (37, 50), np.uint8)
    pyramid = Pyramid(gray)
    assert pyramid.shape == (37, 50)
    assert pyramid.image(0) is gray
    assert pyramid.image(3).shape == (4, 6)
    mean = gray[:36].reshape(18, 2, 25, 2).mean((1, 3))
    assert np.abs(pyramid.image(1) - mean).max() <= 0.5
    assert pyramid.image(3) is pyramid.image(3)


def test_there_is_always_a_pixel_left() -> None:
    assert Pyramid(np.zeros((1, 3), np.uint8)).image(4).shape == (1, 1)


def test_noise_alone_is_blank_and_one_small_person_is_not() -> None:
    noise = np.random.default_rng(0).normal(90, 4, (480, 640))
    assert Pyramid(np.clip(noise, 0, 255).astype(np.uint8)).is_blank
    noise[200:220, 300:308] = 150
    assert not Pyramid(np.clip(noise, 0, 255).astype(np.uint8)).is_blank


def test_cells_are_means_of_64_pixels() -> None:
    gray = np.random.default_rng(0).integers(0, 256, (40, 48), np.uint8)
    means = gray.reshape(5, 8, 6, 8).mean((1, 3))
    assert np.abs(Pyramid(gray).cells - means).max() <= 1.5
