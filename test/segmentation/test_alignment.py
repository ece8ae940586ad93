# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.segmentation.alignment import align

SHAPE = (160, 140)
BODY = BodyFrame(70, 80, 120)
STILL = ((1, 0), (0, 1))


def walker(turn=STILL, shift=(0, 0)) -> np.ndarray:
    """Draw a head, a trunk and two legs, turned and stretched about the body's middle."""
    mask = np.zeros(SHAPE, np.uint8)
    cv2.circle(mask, (70, 30), 10, 255, -1)
    cv2.ellipse(mask, (70, 66), (16, 30), 0, 0, 360, 255, -1)
    cv2.line(mask, (70, 90), (52, 138), 255, 9)
    cv2.line(mask, (70, 90), (90, 138), 255, 9)
    matrix = np.array(turn, np.float64)
    middle = np.array([BODY.center_x, BODY.center_y]) - 0.5
    offset = middle + np.array(shift) - matrix @ middle
    return cv2.warpAffine(mask, np.column_stack([matrix, offset]), SHAPE[::-1])


def iou(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a > 127, b > 127
    return float((a & b).sum() / (a | b).sum())


@pytest.mark.parametrize(
    ('turn', 'shift'),
    [
        (STILL, (6, -5)),
        (((1.2, 0), (0, 1)), (0, 0)),
        (((1, 0), (0, 1.1)), (0, 0)),
        (((1, 0.15), (0, 1)), (0, 0)),
        (((1.1, -0.1), (0, 0.95)), (4, 3)),
    ],
)
def test_the_template_follows_the_likelihood(turn, shift) -> None:
    likelihood = walker(turn, shift)
    moved, place = align(walker(), likelihood, BODY)
    assert iou(moved, likelihood) > 0.9 > iou(walker(), likelihood)
    assert place.center_x == pytest.approx(BODY.center_x + shift[0], abs=2.5)
    assert place.center_y == pytest.approx(BODY.center_y + shift[1], abs=4)
    assert place.height == pytest.approx(BODY.height * turn[1][1], rel=0.05)


def test_where_it_fits_it_stays() -> None:
    moved, place = align(walker(), walker(), BODY)
    assert np.array_equal(moved, walker())
    assert place == BODY


def test_who_is_cut_off_goes_on_beyond_the_border() -> None:
    likelihood = walker(shift=(0, -6))[:100]
    template = walker()[:100]
    moved, _ = align(template, likelihood, BODY)
    assert iou(moved, likelihood) > iou(template, likelihood)
    assert moved[-1].any()


@pytest.mark.parametrize('value', [0, 255])
def test_nothing_to_go_by_is_no_harm(value: int) -> None:
    even = np.full(SHAPE, value, np.uint8)
    moved, place = align(walker(), even, BODY)
    assert moved.shape == SHAPE
    assert abs(place.center_x - BODY.center_x) <= 0.16 * BODY.height
    assert not align(np.zeros(SHAPE, np.uint8), even, BODY)[0].any()


def test_the_inputs_are_left_alone() -> None:
    template, likelihood = walker(), walker(shift=(5, 5))
    given = template.copy(), likelihood.copy()
    align(template[2:-2, 3:-3], likelihood[2:-2, 3:-3], BODY)
    assert np.array_equal(template, given[0])
    assert np.array_equal(likelihood, given[1])
