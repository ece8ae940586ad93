# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.sampling import antialiasing_side, resampled, warp_template


@pytest.mark.parametrize(('pitch', 'side'), [(0.01, 1), (1.0, 1), (1.5, 1), (2.0, 3), (4.0, 5)])
def test_the_filter_is_odd_and_about_as_wide_as_the_samples_are_apart(pitch, side):
    assert antialiasing_side(pitch) == side


def test_a_part_is_sampled_as_the_whole_is_smoothed():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (60, 80), dtype=np.uint8)
    known = np.where(rng.random(image.shape) < 0.6, 255, 0).astype(np.uint8)
    # Pixels of the grid are those of the image from (20, 15) on.
    grid = np.array([[1.0, 0.0, 20.0], [0.0, 1.0, 15.0]])
    for mask in (None, known):
        values = image if mask is None else image & mask
        whole = cv2.blur(values, (9, 9))
        if mask is not None:
            whole = cv2.divide(whole, cv2.blur(mask, (9, 9)), scale=255) & mask
        (found,), seen = resampled(image, mask, [grid], (30, 26), 9)
        np.testing.assert_array_equal(found, whole[15:41, 20:50])
        assert (seen is None) == (mask is None)


@pytest.mark.parametrize(('x', 'y'), [(-1, 0), (0, -1), (51, 0), (0, 35)])
def test_what_is_outside_of_the_image_is_not_known(x, y):
    image = np.full((60, 80), 255, np.uint8)
    grid = np.array([[1.0, 0.0, float(x)], [0.0, 1.0, float(y)]])
    (found,), seen = resampled(image, None, [grid], (30, 26), 1)
    assert seen is not None
    assert 0 < (seen == 0).sum() <= 30
    np.testing.assert_array_equal(found, seen[0])


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
