# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.tanimoto import ReferenceKernel, WindowGrid


def test_sums_the_smaller_of_template_and_window():
    grid = WindowGrid(1, 2, 1, 2)
    templates = np.array([[[10, 200]], [[0, 0]]], np.uint8)
    images = np.array([[[20, 100, 255]]], np.uint8)
    common = ReferenceKernel(templates, grid).common_area(images)
    np.testing.assert_array_equal(common[:, 0, 0], [[10 + 100, 10 + 200], [0, 0]])
