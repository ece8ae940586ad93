# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.sampling import (
    antialiasing_side,
    inside,
    region,
    smoothed,
    warp_template,
)


@pytest.mark.parametrize(('pitch', 'side'), [(0.01, 1), (1.0, 1), (1.5, 1), (2.0, 3), (4.0, 5)])
def test_the_filter_is_odd_and_about_as_wide_as_the_samples_are_apart(pitch, side):
    assert antialiasing_side(pitch) == side


def test_inside_is_inside_of_all_sides():
    assert inside((0, 0, 30, 20), (20, 30))
    assert inside((1, 1, 29, 19), (20, 30), 1)
    for sides in ((-1, 0, 30, 20), (0, -1, 30, 20), (0, 0, 31, 20), (0, 0, 30, 21)):
        assert not inside(sides, (20, 30))


def test_a_part_is_smoothed_as_the_whole():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (60, 80), dtype=np.uint8)
    known = np.where(rng.random(image.shape) < 0.6, 255, 0).astype(np.uint8)
    every = slice(0, 60), slice(0, 80)
    for mask in (None, known):
        whole, _ = smoothed(image, mask, every, 9)
        window = region((20.2, 15.5, 50.0, 40.1), image.shape, 9)
        part, _ = smoothed(image, mask, window, 9)
        rows, columns = slice(15, 41), slice(20, 50)
        inner = part[15 - window[0].start :, 20 - window[1].start :][:26, :30]
        np.testing.assert_array_equal(inner, whole[rows, columns])


@pytest.fixture
def template():
    image = np.zeros((40, 30), np.uint8)
    image[2:38, 10:20] = 255
    return image


@pytest.mark.parametrize('height', [9.0, 36.0, 90.0])
def test_keeps_place_and_area(template, height):
    body = BodyFrame(70.0, 60.0, height)
    prior = warp_template(template, body, 0.9, (130, 150))
    area = prior.sum(dtype=np.float64) / 255
    assert prior.shape == (130, 150)
    assert prior.dtype == np.uint8
    assert area == pytest.approx(height * height * 10 / 36, rel=0.03)
    y, x = np.nonzero(prior > 127)
    assert x.mean() + 0.5 == pytest.approx(70.0, abs=0.6)
    assert y.mean() + 0.5 == pytest.approx(60.0, abs=0.6)


def test_tilts_with_the_head_to_the_right(template):
    prior = warp_template(template, BodyFrame(75.0, 65.0, 100.0, 0.4), 0.9, (130, 150))
    assert np.nonzero(prior[25] > 127)[0].mean() > 80


def test_outside_of_the_image_is_black(template):
    assert not warp_template(template, BodyFrame(-80.0, 60.0, 40.0), 0.9, (50, 60)).any()
