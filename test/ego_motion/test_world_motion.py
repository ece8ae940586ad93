# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.world_motion import Ground, WorldMotion
from gait_segmentation.warping import warp_window

CAMERA = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 0.0]])
COLUMNS = slice(10, 60)


def ground_from(row: int) -> Ground:
    return Ground(np.array([[1.0, 0.0625, -4.0], [0.0, 1.0, 0.0]]), row)


def test_motions_of_the_ground_add_up_and_the_world_takes_its_place_where_there_is_none() -> None:
    right = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 0.0]])
    ground = Ground(np.array([[1.0, 0.1, -1.0], [0.0, 1.0, 0.0]]), 40)
    panned, still = WorldMotion(right), WorldMotion()
    assert WorldMotion.over([panned, still]).ground is None
    total = WorldMotion.over([WorldMotion(right, ground), still, panned]).ground
    assert total is not None
    assert total.row == 40
    assert total.motion @ [5, 20, 1] == pytest.approx([5 + 2.0 - 1.0 + 2.0, 20])


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
    steps = WorldMotion(CAMERA, ground_from(40)), WorldMotion(CAMERA, ground_from(44))
    back = WorldMotion.over(steps).inverse()
    assert WorldMotion.over([*steps, back]).carry(10, 20) == pytest.approx((10, 20))
    ground = WorldMotion.over([*steps, back]).ground
    assert ground is not None
    assert ground.row == 44
    assert ground.motion @ [16, 48, 1] == pytest.approx([16, 48])
    fell = WorldMotion(None, Ground(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 5.0]]), 40)).inverse()
    assert fell.camera is None
    assert fell.ground is not None
    assert fell.ground.row == 35
    assert WorldMotion().inverse() == WorldMotion()


def test_a_further_shift_of_the_world_is_added() -> None:
    still = WorldMotion()
    assert still.corrected(None) is still
    assert still.corrected((0.25, -0.5)).carry(10, 20) == pytest.approx((10.25, 19.5))
    turned = WorldMotion(np.array([[0.0, -1, 0], [1, 0, 0]])).corrected((0.25, -0.5))
    assert turned.carry(10, 20) == pytest.approx((-19.75, 9.5))


def test_world_and_ground_are_shifted_further_each_by_itself() -> None:
    before = WorldMotion(CAMERA, ground_from(40))
    after = before.corrected(None, (0.5, 0.25))
    assert after.carry(10, 20) == before.carry(10, 20)
    assert after.ground is not None
    assert after.ground.row == 40
    assert after.ground.motion @ [16, 48, 1] == pytest.approx([16 + 3 - 4 + 0.5, 48.25])
    # Without ground there is nothing that moves otherwise.
    assert WorldMotion(CAMERA).corrected(None, (0.5, 0.25)).ground is None


def test_windows_are_parted_at_the_row_from_which_the_ground_is_seen() -> None:
    windows = [(slice(0, 30), COLUMNS), (slice(20, 50), COLUMNS), (slice(40, 60), COLUMNS)]
    assert WorldMotion(CAMERA).parted(windows) == (windows, [])
    upper, lower = WorldMotion(CAMERA, ground_from(40)).parted(windows)
    assert upper == [windows[0], (slice(20, 40), COLUMNS)]
    assert lower == [(slice(40, 50), COLUMNS), windows[2]]


@pytest.mark.parametrize('row', [0, 20, 33, 50, 70])
@pytest.mark.parametrize('border', [cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT])
def test_both_parts_of_an_image_are_warped_by_motions_of_their_own(row: int, border: int) -> None:
    image = np.random.default_rng(1).integers(0, 255, (64, 80)).astype(np.uint8)
    window, ground = (slice(20, 50), COLUMNS), ground_from(row)
    made = WorldMotion(CAMERA, ground).warped(image, window, border)
    above = warp_window(image, CAMERA, window, border)
    below = warp_window(image, ground.motion, window, border)
    cut = min(max(row - 20, 0), 30)
    np.testing.assert_array_equal(made[:cut], above[:cut])
    np.testing.assert_array_equal(made[cut:], below[cut:])
    np.testing.assert_array_equal(WorldMotion(CAMERA).warped(image, window, border), above)
