# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.scene.light import Contrast, Light
from gait_segmentation.scene.working import Pyramid, WorkingImage, working_scale, working_shape
from gait_segmentation.scene.world_motion import WorldMotion


def test_tall_people_are_scaled_down_and_small_ones_never_up() -> None:
    sizes = {'working_size': 640, 'working_height': 160}
    assert working_scale(480, 640, person_height=320, **sizes) == pytest.approx(0.5)
    assert working_scale(480, 640, person_height=50, **sizes) == 1
    assert working_scale(1080, 1920, person_height=50, **sizes) == pytest.approx(1 / 3)
    assert working_scale(1080, 1920, person_height=50, working_size=0, working_height=160) == 1


def test_a_working_image_is_never_empty() -> None:
    assert working_shape(1, 1000, 0.1) == (1, 100)


def test_a_frame_outlives_the_buffer_it_came_from() -> None:
    image = np.full((20, 30, 3), (180, 200, 220), np.uint8)
    frame = WorkingImage.of(image, 3, (20, 30))
    image[:] = 0
    assert frame.lab[..., 0].min() > 150


def test_a_jump_of_the_exposure_is_undone_before_levels_are_spread() -> None:
    image = np.random.default_rng(0).integers(60, 130, (240, 320, 3)).astype(np.uint8)
    image = cv2.blur(image, (5, 5))
    light, contrast, made = Light(), Contrast(), []
    for gain in (1.0, 1.5):
        bright = cv2.convertScaleAbs(image, alpha=gain)
        made.append(WorkingImage.of(bright, 3, (240, 320), light, contrast))
        light.follow(WorldMotion(), np.zeros((240, 320), np.uint8))
    assert np.ptp(made[0].gray) > 1.5 * np.ptp(image)
    assert np.abs(made[1].gray.astype(int) - made[0].gray).mean() < 2


def test_the_brightness_of_spread_levels_is_nearly_that_of_the_colours() -> None:
    image = np.random.default_rng(3).integers(60, 130, (480, 640, 3)).astype(np.uint8)
    frame = WorkingImage.of(image, 3, (480, 640), contrast=Contrast())
    assert np.ptp(frame.bgr) > 1.5 * np.ptp(image)
    brightness = cv2.cvtColor(frame.bgr, cv2.COLOR_BGR2GRAY).astype(int)
    assert np.abs(frame.gray - brightness).max() <= 2
    assert np.array_equal(frame.pyramid.image(0), frame.gray)


def test_a_grey_frame_shows_texture() -> None:
    gray = np.random.default_rng(2).integers(0, 255, (40, 60)).astype(np.uint8)
    image = cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR)
    frame = WorkingImage.of(image, 3, (40, 60))
    assert frame.textured
    assert len(np.unique(frame.lab[..., 1])) > 5
    plain = WorkingImage.of(image, 3, (40, 60), texture=False)
    assert (plain.lab[..., 1:] == 128).all()
    window = slice(3, 40, 2), slice(0, 60, 2)
    assert np.array_equal(frame.lab_part(window), frame.lab[window])
    assert frame.lab_part(window).flags.c_contiguous


@pytest.mark.parametrize('texture', [False, True])
def test_a_frame_tells_that_it_has_lost_its_colours(texture: bool) -> None:
    image = np.random.default_rng(2).integers(0, 255, (40, 60, 3)).astype(np.uint8)
    gray = cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    light = Light()
    assert not WorkingImage.of(image, 3, (40, 60), light).faded
    frame = WorkingImage.of(gray, 4, (40, 60), light, texture=texture)
    assert frame.faded
    assert frame.textured == texture
    assert not WorkingImage.of(gray, 4, (40, 60), Light()).faded


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
