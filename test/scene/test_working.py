# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.scene.ego_motion import Pyramid, WorldMotion
from gait_segmentation.scene.light import Contrast, Light
from gait_segmentation.scene.working import WorkingImage, working_scale


def test_tall_people_are_scaled_down_and_small_ones_never_up() -> None:
    sizes = {'working_size': 640, 'working_height': 160}
    assert working_scale(480, 640, person_height=320, **sizes) == pytest.approx(0.5)
    assert working_scale(480, 640, person_height=50, **sizes) == 1
    assert working_scale(1080, 1920, person_height=50, **sizes) == pytest.approx(1 / 3)
    assert working_scale(1080, 1920, person_height=50, working_size=0, working_height=160) == 1


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


@pytest.mark.parametrize('texture', [False, True])
def test_a_grey_frame_shows_texture_and_tells_that_it_has_lost_its_colours(texture: bool) -> None:
    image = np.random.default_rng(2).integers(0, 255, (40, 60, 3)).astype(np.uint8)
    gray = cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    light = Light()
    assert not WorkingImage.of(image, 3, (40, 60), light).faded
    frame = WorkingImage.of(gray, 4, (40, 60), light, texture=texture)
    assert frame.faded
    assert not WorkingImage.of(gray, 4, (40, 60), Light()).faded
    assert frame.textured == (len(np.unique(frame.lab[..., 1])) > 5) == texture
    assert texture or (frame.lab[..., 1:] == 128).all()
    window = slice(3, 40, 2), slice(0, 60, 2)
    assert np.array_equal(frame.lab_part(window), frame.lab[window])
    assert frame.lab_part(window).flags.c_contiguous


def test_noise_alone_is_blank_and_one_small_person_is_not() -> None:
    noise = np.random.default_rng(0).normal(90, 4, (480, 640))
    assert Pyramid(np.clip(noise, 0, 255).astype(np.uint8)).is_blank
    noise[200:220, 300:308] = 150
    assert not Pyramid(np.clip(noise, 0, 255).astype(np.uint8)).is_blank
