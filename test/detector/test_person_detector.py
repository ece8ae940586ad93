# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.detector.person_detector import (
    LEAST_SHARE,
    PersonDetector,
    default_detector,
)
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from test.networks import WOMAN, demo_picture


def sure(image):
    return [each.box for each in default_detector().people(image) if each.score > 0.5]


@pytest.mark.parametrize('scale', [0.5, 1.0, 2.0])
@pytest.mark.parametrize('mirrored', [False, True])
def test_a_person_is_seen_where_they_are_whatever_the_size_of_the_image(scale, mirrored):
    image = demo_picture()
    x = image.shape[1] - WOMAN.right if mirrored else WOMAN.x
    image = cv2.resize(image[:, ::-1] if mirrored else image, None, fx=scale, fy=scale)
    (box,) = sure(image)
    assert box.iou(Box(x, WOMAN.y, WOMAN.width, WOMAN.height).scaled(scale)) > 0.8


@pytest.mark.parametrize('shape', [(1, 1), (3, 900), (480, 640), (212, 560)])
def test_nobody_is_seen_where_nothing_is(shape):
    assert default_detector().people(np.full((*shape, 3), 200, np.uint8)) == []


def test_a_closer_look_sees_smaller_people_and_everybody_once():
    picture = demo_picture()
    small = cv2.resize(picture, None, fx=0.38, fy=0.38, interpolation=cv2.INTER_AREA)
    image = np.full((480, 640, 3), 128, np.uint8)
    image[268 : 268 + picture.shape[0], : picture.shape[1]] = picture
    image[20 : 20 + small.shape[0], 300 : 300 + small.shape[1]] = small
    people = WOMAN.scaled(0.38).shifted(300, 20), WOMAN.shifted(0, 268)
    assert people[0].height < LEAST_SHARE * 640 < people[1].height
    for look, number in (default_detector().people, [0, 1]), (default_detector().closely, [1, 1]):
        found = [each.box for each in look(image) if each.score > 0.4]
        assert [sum(box.iou(person) > 0.5 for box in found) for person in people] == number
    seen = default_detector().closely(image)
    assert seen == sorted(seen, key=lambda each: -each.score)
    assert max(a.box.iou(b.box) for a in seen for b in seen if a is not b) < 0.6


def test_who_is_seen_at_both_looks_is_told_of_once_by_the_surer_one():
    small = cv2.resize(demo_picture(), None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)
    image = np.full((480, 640, 3), 128, np.uint8)
    image[100 : 100 + small.shape[0], 200 : 200 + small.shape[1]] = small
    looks = default_detector().people(image), default_detector().closely(image)
    assert [len(found) for found in looks] == [1, 1]
    assert looks[1][0].score > looks[0][0].score


@pytest.mark.parametrize('corner', [0.0, 0.4, 1.0])
def test_a_look_about_a_box_sees_who_is_in_it_more_surely_and_nobody_else(corner):
    picture = cv2.resize(demo_picture(), None, fx=0.38, fy=0.38, interpolation=cv2.INTER_AREA)
    height, width = picture.shape[:2]
    y, x = round(corner * (480 - height)), round(corner * (640 - width))
    image = np.full((480, 640, 3), 128, np.uint8)
    image[y : y + height, x : x + width] = picture
    person = WOMAN.scaled(0.38).shifted(x, y)
    (found,) = default_detector().about(image, person.shifted(2, -2))
    assert found.box.iou(person) > 0.6
    assert found.score > max((each.score for each in default_detector().people(image)), default=0)
    assert default_detector().about(image, person.shifted(person.width, 0)) == []


def test_of_tall_people_a_closer_look_tells_nothing_else():
    first, closer = (
        default_detector().people(demo_picture()),
        default_detector().closely(demo_picture()),
    )
    tall = [each for each in closer if each.box.height > 0.2 * demo_picture().shape[1]]
    assert tall == [each for each in first if each in tall] != []


def test_every_look_gives_the_same():
    first, second = (
        PersonDetector().people(demo_picture()),
        default_detector().people(demo_picture()),
    )
    assert first == second
    assert first == sorted(first, key=lambda each: -each.score)


def test_what_is_no_image_is_refused():
    with pytest.raises(InputError):
        default_detector().people(np.zeros((10, 10), np.uint8))
