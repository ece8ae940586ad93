# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.ground import Ground, ground_over, parted, warp_parts
from gait_segmentation.warping import warp_window

CAMERA = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 0.0]])
COLUMNS = slice(10, 60)


def ground_from(row: int) -> Ground:
    return Ground(np.array([[1.0, 0.0625, -4.0], [0.0, 1.0, 0.0]]), row)


def test_motions_of_the_ground_add_up_and_the_world_takes_its_place_where_there_is_none() -> None:
    right = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 0.0]])
    ground = Ground(np.array([[1.0, 0.1, -1.0], [0.0, 1.0, 0.0]]), 40)
    assert ground_over([(right, None), (None, None)]) is None
    total = ground_over([(right, ground), (None, None), (right, None)])
    assert total is not None
    assert total.row == 40
    assert total.motion @ [5, 20, 1] == pytest.approx([5 + 2.0 - 1.0 + 2.0, 20])


def test_windows_are_parted_at_the_row_from_which_the_ground_is_seen() -> None:
    windows = [(slice(0, 30), COLUMNS), (slice(20, 50), COLUMNS), (slice(40, 60), COLUMNS)]
    assert parted(windows, None) == (windows, [])
    upper, lower = parted(windows, ground_from(40))
    assert upper == [windows[0], (slice(20, 40), COLUMNS)]
    assert lower == [(slice(40, 50), COLUMNS), windows[2]]


@pytest.mark.parametrize('row', [0, 20, 33, 50, 70])
@pytest.mark.parametrize('border', [cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT])
def test_both_parts_of_an_image_are_warped_by_motions_of_their_own(row: int, border: int) -> None:
    image = np.random.default_rng(1).integers(0, 255, (64, 80)).astype(np.uint8)
    window, ground = (slice(20, 50), COLUMNS), ground_from(row)
    made = warp_parts(image, CAMERA, ground, window, border)
    above = warp_window(image, CAMERA, window, border)
    below = warp_window(image, ground.motion, window, border)
    cut = min(max(row - 20, 0), 30)
    np.testing.assert_array_equal(made[:cut], above[:cut])
    np.testing.assert_array_equal(made[cut:], below[cut:])
    np.testing.assert_array_equal(warp_parts(image, CAMERA, None, window, border), above)
