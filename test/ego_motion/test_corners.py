# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.corners import strength_of, strongest


def test_each_cell_has_one_corner_the_strongest_first() -> None:
    strength, where = np.zeros((16, 24), np.float32), np.full((16, 24), 255, np.uint8)
    strength[3, 2], strength[5, 7] = 0.5, 0.4
    strength[12, 20], strength[9, 10], strength[2, 20] = 1.0, 0.8, 0.001
    where[9, 10] = 0
    found = strongest(strength, where, 8, 0.0, 9)
    np.testing.assert_array_equal(found, [(20.5, 12.5), (2.5, 3.5)])
    np.testing.assert_array_equal(strongest(strength, where, 8, 0.0, 1), found[:1])
    assert len(strongest(strength, where, 8, 0.6, 9)) == 1
    assert len(strongest(strength[:4], where[:4], 8, 0.0, 9)) == 0
    assert len(strongest(strength, 0 * where, 8, 0.0, 9)) == 0


@pytest.mark.parametrize('shape', [(40, 57), (3, 4), (1, 5), (7, 1), (1, 1)])
def test_the_strength_is_the_smaller_eigenvalue(shape: tuple[int, int]) -> None:
    gray = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
    expected = cv2.cornerMinEigenVal(gray, 3)
    np.testing.assert_allclose(strength_of(gray), expected, atol=1e-7)
    part = gray[: (shape[0] + 1) // 2]
    np.testing.assert_allclose(strength_of(part), cv2.cornerMinEigenVal(part, 3), atol=1e-7)
