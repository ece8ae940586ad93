# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.tanimoto import WindowGrid


def test_windows_and_their_areas():
    grid = WindowGrid(5, 4, 3, 2, 2)
    images = np.random.default_rng(0).integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    windows = grid.windows(images)
    assert grid.image_shape == (9, 6)
    assert windows.shape == (2, 3, 2, 5, 4)
    np.testing.assert_array_equal(windows[1, 2, 1], images[1, 4:9, 2:6])
    np.testing.assert_array_equal(grid.areas(images), windows.sum(axis=(3, 4)))
