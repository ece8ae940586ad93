# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.images import distance_from
from gait_segmentation.tracking.visibility import Sight, visible_box

SHAPE = (40, 30)


def block(left: int, top: int, right: int, bottom: int, value: int = 255) -> np.ndarray:
    image = np.zeros(SHAPE, np.uint8)
    image[top:bottom, left:right] = value
    return image


def test_who_stands_out_is_seen_with_confidence() -> None:
    mask = block(10, 5, 20, 35)
    sight = Sight.of(block(10, 5, 20, 35, 204), mask, None)
    assert (sight.share, sight.seen, sight.confidence) == pytest.approx((1, 0.8, 0.8))


def test_what_others_hide_is_not_seen() -> None:
    mask = block(10, 5, 20, 35)
    sight = Sight.of(mask, mask, block(0, 20, 30, 40))
    assert sight.share == pytest.approx(0.5)
    assert sight.inside == pytest.approx(1)
    assert (sight.seen, sight.confidence) == pytest.approx((0.5, 0.5))
    np.testing.assert_array_equal(sight.uncovered, block(10, 5, 20, 20))


def test_others_are_not_what_is_around() -> None:
    mask, other = block(10, 5, 20, 35), block(20, 5, 30, 35)
    likely = mask | other
    assert Sight.of(likely, mask, None).outside > 0.2
    assert Sight.of(likely, mask, other, other).outside == 0


def test_what_stands_before_a_person_is_not_looked_at() -> None:
    mask, likely = block(4, 10, 24, 50), block(4, 10, 9, 50)
    sight = Sight.of(likely, mask, None)
    part = sight.before(block(4, 0, 9, 60, 1), likely)
    assert (part.share, part.inside) == pytest.approx((0.25, 1.0))
    assert part.seen == pytest.approx(sight.seen)
    assert sight.before(np.zeros_like(mask), likely).seen == 0


def test_the_box_is_about_the_likely_pixels_near_the_mask() -> None:
    mask = block(10, 5, 20, 35)
    likely = block(10, 5, 20, 30) | block(26, 5, 28, 35)
    window = (slice(100, 140), slice(50, 80))
    away = distance_from(mask > 127)
    assert visible_box(likely, mask, away, window, 30) == Box(60, 105, 10, 25)
    assert visible_box(block(10, 5, 20, 9), mask, away, window, 30) is None
    nowhere = distance_from(mask > 255)
    assert visible_box(likely, mask, nowhere, window, 30) is None


def test_the_means_are_those_of_opencv() -> None:
    rng = np.random.default_rng(4)
    values = rng.integers(0, 256, SHAPE, np.uint8)
    mask = block(10, 5, 20, 35)
    sight = Sight.of(values, mask, None)
    assert sight.inside == pytest.approx(cv2.mean(values, mask)[0] / 255)
    assert sight.outside == pytest.approx(cv2.mean(values, cv2.bitwise_not(mask))[0] / 255)
