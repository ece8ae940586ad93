# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.person.extent import axis_tilt, extent_of


def test_a_mask_is_measured_from_a_point() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[10:50, 20:40] = 255
    extent = extent_of(mask, (30, 30), 0.0)
    assert (extent.top, extent.bottom, extent.left, extent.right) == (-20, 20, -10, 10)
    assert extent.axis == pytest.approx(0, abs=0.5)
    assert extent.middle == 0
    assert not extent.at_bottom
    mask[50:] = mask[49]
    assert extent_of(mask, (30, 30), 0.0).at_bottom


def test_along_a_tilted_body_the_extent_is_that_of_the_body() -> None:
    mask = np.zeros((200, 200), np.uint8)
    cv2.ellipse(mask, (100, 100), (20, 60), 20, 0, 360, 255, -1)
    extent = extent_of(mask, (100, 100), np.radians(20))
    assert extent.bottom - extent.top == pytest.approx(120, abs=3)
    assert extent.right - extent.left == pytest.approx(40, abs=3)


@pytest.mark.parametrize('degrees', [-30, 0, 12, 25])
def test_the_tilt_is_that_of_the_main_axis(degrees: int) -> None:
    mask = np.zeros((200, 200), np.uint8)
    cv2.ellipse(mask, (100, 100), (20, 60), degrees, 0, 360, 255, -1)
    assert axis_tilt(mask) == pytest.approx(np.radians(degrees), abs=0.01)
    assert axis_tilt(np.zeros((5, 5), np.uint8)) == 0
