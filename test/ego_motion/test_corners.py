# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.ego_motion.corners import followed, strongest


def test_each_cell_has_one_corner_the_strongest_first() -> None:
    strength, where = np.zeros((16, 24), np.float32), np.full((16, 24), 255, np.uint8)
    strength[3, 2], strength[5, 7] = 0.5, 0.4
    strength[12, 20], strength[9, 10], strength[2, 20] = 1.0, 0.8, 0.001
    where[9, 10] = 0
    found = strongest(strength, where, 8, 0.0)
    np.testing.assert_array_equal(found, [(20.5, 12.5), (2.5, 3.5)])
    assert len(strongest(strength, where, 8, 0.6)) == 1
    assert len(strongest(strength[:4], where[:4], 8, 0.0)) == 0


def test_points_are_followed_to_a_part_of_a_pixel() -> None:
    y, x = np.mgrid[:60, :80]
    last, now = (
        (128 + 60 * np.sin((x - dx) / 5) * np.sin(y / 4)).astype(np.uint8) for dx in (0, 1.5)
    )
    before, after = followed(last, now, np.float32([(30.5, 30.5), (50.5, 24.5)]), 11, 2)
    assert len(before) == 2
    for moved in after - before:
        assert moved == pytest.approx((1.5, 0.0), abs=0.1)
    none, _ = followed(last, now, np.empty((0, 2), np.float32), 11, 2)
    assert len(none) == 0
