# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.shape_prior import warp_template


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
