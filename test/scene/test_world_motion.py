# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import scaling
from gait_segmentation.scene.world_motion import WorldMotion, warp_window

CAMERA = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 0.0]])


def test_motions_of_the_camera_are_made_one_after_the_other() -> None:
    turn, step = np.array([[0.0, -1, 0], [1, 0, 0]]), np.array([[1.0, 0, 2], [0, 1, 3]])
    still = WorldMotion()
    total = WorldMotion.over([still, WorldMotion(turn), still, WorldMotion(step)])
    assert total.carry(5, 1) == pytest.approx((1, 8))
    assert total.transform @ [5, 1, 1] == pytest.approx((1, 8))
    for nothing in (WorldMotion.over([still, still]), WorldMotion.over([])):
        assert nothing.camera is None
        assert nothing.carry(5, 1) == (5, 1)
        assert nothing.transform @ [5, 1, 1] == pytest.approx((5, 1))


def test_the_way_back_leads_to_where_it_began() -> None:
    steps = WorldMotion(CAMERA), WorldMotion(np.array([[0.0, -1, 0], [1, 0, 0]]))
    back = WorldMotion.over(steps).inverse()
    assert WorldMotion.over([*steps, back]).carry(10, 20) == pytest.approx((10, 20))
    assert WorldMotion().inverse() == WorldMotion()


@pytest.mark.parametrize('border', [cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT])
def test_images_are_warped_with_the_world(border: int) -> None:
    image = np.random.default_rng(1).integers(0, 255, (64, 80)).astype(np.uint8)
    window = slice(20, 50), slice(60, 80)
    made = WorldMotion(CAMERA).warped(image, window, border)
    np.testing.assert_array_equal(made, warp_window(image, CAMERA, window, border))
    np.testing.assert_array_equal(WorldMotion().warped(image, window, border), image[window])


def test_a_window_of_a_warp_is_the_warps_window() -> None:
    image = np.random.default_rng(0).integers(0, 255, (40, 50), np.uint8)
    motion = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0]])
    window = (slice(10, 20), slice(15, 35))
    part = warp_window(image, motion, window)
    assert np.array_equal(part, image[12:22, 12:32])
    assert np.array_equal(warp_window(image, scaling(1), window), image[window])


@pytest.mark.parametrize(
    'motion',
    [
        [[1.0, 0.0, 3.3], [0.0, 1.0, -1.77]],
        [[0.9, 0.1, 3.0], [-0.1, 0.9, 4.0]],
    ],
)
def test_what_a_window_shows_is_where_the_motion_takes_it(motion: list[list[float]]) -> None:
    image = cv2.GaussianBlur(
        np.random.default_rng(5).integers(0, 256, (90, 130), np.uint8), (0, 0), 3
    )
    window = (slice(20, 60), slice(30, 110))
    part = warp_window(image, np.array(motion), window)
    turn, shift = np.array(motion)[:, :2], np.array(motion)[:, 2]
    for row, column in ((25, 40), (40, 70), (55, 100)):
        x, y = np.linalg.solve(turn, np.array([column, row]) + 0.5 - shift) - 0.5
        left, top = int(x), int(y)
        u, v = x - left, y - top
        corner = image[top : top + 2, left : left + 2].astype(float)
        expected = np.array([1 - v, v]) @ corner @ np.array([1 - u, u])
        assert part[row - 20, column - 30] == pytest.approx(expected, abs=2)


def test_an_empty_window_is_empty() -> None:
    image = np.zeros((9, 8), np.uint8)
    motion = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]])
    assert warp_window(image, motion, (slice(3, 3), slice(1, 6))).shape == (0, 5)
