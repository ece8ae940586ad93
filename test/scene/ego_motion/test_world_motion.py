# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.scene.ego_motion.world_motion import WorldMotion
from gait_segmentation.warping import warp_window

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
