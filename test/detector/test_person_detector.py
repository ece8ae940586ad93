# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.detector.person_detector import PersonDetector, default_detector
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
