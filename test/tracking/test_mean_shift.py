# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gait_segmentation.geometry import Box
from gait_segmentation.tracking.mean_shift import WindowShift, mean_shift

WINDOW = Box(40, 30, 40, 60)


def body(dx: int = 0, dy: int = 0, grow: float = 1.0) -> np.ndarray:
    image = np.zeros((140, 160), np.uint8)
    half_w, half_h = 10 * grow, 25 * grow
    image[
        int(60 + dy - half_h) : int(60 + dy + half_h),
        int(57 + dx - half_w) : int(57 + dx + half_w),
    ] = 255
    return image


@settings(max_examples=40)
@given(st.integers(-12, 12), st.integers(-12, 12))
def test_it_finds_where_the_body_went(dx: int, dy: int) -> None:
    shift = mean_shift(body(dx, dy), body(), WINDOW)
    assert shift.dx == pytest.approx(dx, abs=1)
    assert shift.dy == pytest.approx(dy, abs=1)
    assert shift.scale == pytest.approx(1, abs=0.02)


def test_it_measures_the_change_of_size() -> None:
    assert mean_shift(body(grow=0.8), body(), WINDOW).scale == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize(('now', 'before'), [(0, 1), (1, 0), (0, 0)])
def test_nothing_to_see_is_no_shift(now: int, before: int) -> None:
    assert mean_shift(body() * np.uint8(now), body() * np.uint8(before), WINDOW) == WindowShift(
        0.0, 0.0, 1.0
    )


def test_a_window_outside_of_the_image_is_no_shift() -> None:
    assert mean_shift(body(), body(), Box(500, 500, 10, 10)) == WindowShift(0.0, 0.0, 1.0)


def test_a_likelihood_of_any_grey_counts_by_its_value() -> None:
    rng = np.random.default_rng(2)
    weights = rng.integers(0, 256, (120, 110), np.uint8)
    moments, before = (cv2.moments(each[30:90, 40:80]) for each in (weights, body()))
    shift = mean_shift(weights, body(), WINDOW)
    assert shift.scale == pytest.approx((moments['m00'] / before['m00']) ** 0.5, rel=0.05)
