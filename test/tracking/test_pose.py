# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.tracking.pose import Pose

SHAPE = (240, 320)


def ellipse(x: float, y: float, height: float, degrees: float = 0.0) -> np.ndarray:
    mask = np.zeros(SHAPE, np.uint8)
    axes = (round(height / 6), round(height / 2))
    cv2.ellipse(mask, (round(x), round(y)), axes, degrees, 0, 360, 255, -1)
    return mask


def standing(y: float = 120, height: float = 100) -> Pose:
    return Pose(100, y, height, 20, 20, mask_height=height)


@pytest.mark.parametrize('degrees', [0, 20])
def test_place_and_size_follow_the_masks_in_the_frame_of_the_body(degrees: int) -> None:
    state = standing()
    # A single bad mask changes little.
    state = state.fitted(ellipse(100, 120, 20), BodyFrame(100, 120, 20))
    assert state.height >= 98
    grown = state.fitted(ellipse(100, 120, 220), BodyFrame(100, 120, 220))
    assert grown.height < 1.02 * state.height
    state = replace(state, tilt=np.radians(degrees), angle=np.radians(degrees))
    for _ in range(40):
        body = BodyFrame(108, 123, 108, state.angle)
        state = state.fitted(ellipse(108, 123, 108, degrees), body)
    found = state.center_x, state.center_y, state.height
    assert found == pytest.approx((108, 123, 108), abs=2)
    assert state.box.width == pytest.approx(36, abs=3)


def test_a_body_that_leaves_below_keeps_its_height_and_hangs_from_the_head() -> None:
    state = standing(y=180, height=100)
    for top in (140, 150, *[160] * 20):
        mask = np.zeros(SHAPE, np.uint8)
        mask[top:, 90:110] = 255
        state = state.fitted(mask, BodyFrame(100, top + 50, 100))
    assert state.height == pytest.approx(100, abs=3)
    assert state.center_y - state.height / 2 == pytest.approx(160, abs=3)


def test_somebody_who_comes_in_from_below_is_at_least_as_tall_as_what_is_seen() -> None:
    height = SHAPE[0]
    state = standing(y=height - 20, height=60)
    for top in range(height - 60, height - 120, -6):
        mask = np.zeros(SHAPE, np.uint8)
        mask[top:, 80:120] = 255
        state = state.fitted(mask, BodyFrame(100, top + 30, 60))
    assert state.height >= 110
    assert state.center_y - state.height / 2 == pytest.approx(top, abs=3)
    mask[:] = 0
    mask[top:, 40:160] = 255
    for _ in range(10):
        state = state.fitted(mask, BodyFrame(100, top + 30, 60))
    assert state.height >= 190


def test_of_who_is_taken_to_stand_the_next_step_sets_the_velocity() -> None:
    walks = replace(standing(), velocity=(90.0, 0.0), moves=30).standing()
    assert walks.velocity == (0.0, 0.0)
    assert walks.with_step((1.0, 0.0), (5.0, 0.0), 0.1).velocity == pytest.approx((40.0, 0.0))


def test_the_first_step_sets_the_velocity() -> None:
    state = standing()
    state = state.with_step((1.0, 0.0), (5.0, 1.0), 0.04)
    assert state.velocity == pytest.approx((100.0, 25.0))
    state = state.with_step((1.0, 0.0), (7.0, 1.0), 0.04)
    assert state.velocity == pytest.approx((125.0, 25.0))
    assert state.step(0.1) == pytest.approx((12.5, 2.5))


@pytest.mark.parametrize('side', [-1, 1])
def test_a_tilt_is_used_from_a_large_one_on_until_it_is_small(side: int) -> None:
    leaning = standing()
    for degrees, used in ((7.5, False), (5.0, False), (20.0, True), (7.5, True), (0.0, False)):
        for _ in range(40):
            leaning = leaning.tilted(ellipse(100, 120, 100, side * degrees))
        assert np.degrees(leaning.angle) == pytest.approx(side * degrees * used, abs=2)


def test_the_first_tilts_are_averaged() -> None:
    leaning = standing()
    for degrees, mean in (20.0, 20.0), (11.0, 15.5), (5.0, 12.0):
        leaning = leaning.tilted(ellipse(100, 120, 100, degrees))
        assert np.degrees(leaning.tilt) == pytest.approx(mean, abs=1)
