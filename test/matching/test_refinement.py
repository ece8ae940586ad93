# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.matching.refinement import refined_box

BODY = 80.0
PLACE = (slice(10, 106), slice(8, 72))
TWICE = np.array([[2.0, 0.0, 100.0], [0.0, 2.0, 50.0]])


def template():
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
    box = refined_box(image, template(), PLACE, BODY, TWICE)
    assert sides(box) == pytest.approx([156, 98, 204, 242])


def test_what_is_far_from_the_template_or_thin_or_unlikely_is_not_the_persons():
    image = likelihood(slice(24, 96), slice(32, 48))
    expected = refined_box(image, template(), PLACE, BODY, TWICE)
    image[20:60, 70:80] = 255
    image[22, 40] = 255
    image[24:96, 48:50] = 180
    assert refined_box(image, template(), PLACE, BODY, TWICE) == expected


def test_people_reach_an_eighth_of_their_height_beyond_the_template():
    image = likelihood(slice(24, 96), slice(23, 57))
    assert sides(refined_box(image, template(), PLACE, BODY, TWICE)) == [146, 98, 214, 242]
    image = likelihood(slice(24, 96), slice(16, 64))
    assert sides(refined_box(image, template(), PLACE, BODY, TWICE)) == [144, 98, 216, 242]


def test_the_box_is_upright_where_the_body_leans():
    angle = math.radians(30)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    to_source = np.column_stack([turn, [0.0, 0.0]])
    image = likelihood(slice(24, 96), slice(32, 48))
    box = refined_box(image, template(), PLACE, BODY, to_source)
    assert box.height == pytest.approx(72 * math.cos(angle) + 16 * math.sin(angle), abs=1.5)


def test_nothing_likely_has_no_box():
    image = likelihood(slice(0), slice(0))
    assert refined_box(image, template(), PLACE, BODY, TWICE) is None
