# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.sampling import (
    antialiasing_side,
    refined_box,
    resampled,
    warp_template,
)


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


def test_outside_of_the_image_is_black(template):
    assert not warp_template(template, BodyFrame(-80.0, 60.0, 40.0), 0.9, (50, 60)).any()


BODY = 80.0
PLACE = (slice(10, 106), slice(8, 72))
TWICE = np.array([[2.0, 0.0, 100.0], [0.0, 2.0, 50.0]])


def upright():
    image = np.zeros((96, 64), np.uint8)
    image[8:88, 24:40] = 255
    return image


def likelihood(rows, columns):
    image = np.zeros((116, 84), np.uint8)
    image[rows, columns] = 255
    return image


def sides(box):
    return [box.x, box.y, box.right, box.bottom]


def test_the_box_is_that_of_what_is_likely_where_the_template_stands():
    """Who carries something is broader than the template, and may be shorter."""
    image = likelihood(slice(24, 96), slice(28, 52))
    box = refined_box(image, upright(), PLACE, BODY, TWICE)
    assert sides(box) == pytest.approx([156, 98, 204, 242])


def test_what_is_far_from_the_template_or_thin_or_unlikely_is_not_the_persons():
    image = likelihood(slice(24, 96), slice(32, 48))
    expected = refined_box(image, upright(), PLACE, BODY, TWICE)
    image[20:60, 70:80] = 255
    image[22, 40] = image[60, 50] = 255
    image[24:96, 48:50] = 180
    assert refined_box(image, upright(), PLACE, BODY, TWICE) == expected


def test_people_reach_an_eighth_of_their_height_beyond_the_template():
    image = likelihood(slice(24, 96), slice(23, 57))
    assert sides(refined_box(image, upright(), PLACE, BODY, TWICE)) == [146, 98, 214, 242]
    image = likelihood(slice(24, 96), slice(16, 64))
    assert sides(refined_box(image, upright(), PLACE, BODY, TWICE)) == [144, 98, 216, 242]


def test_the_box_is_upright_where_the_body_leans():
    angle = math.radians(30)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    to_source = np.column_stack([turn, [0.0, 0.0]])
    image = likelihood(slice(24, 96), slice(32, 48))
    box = refined_box(image, upright(), PLACE, BODY, to_source)
    assert box.height == pytest.approx(72 * math.cos(angle) + 16 * math.sin(angle), abs=1.5)


def test_nothing_likely_has_no_box():
    image = likelihood(slice(0), slice(0))
    assert refined_box(image, upright(), PLACE, BODY, TWICE) is None
