# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.matching.tanimoto import EventKernel, WindowGrid


def test_windows_and_their_areas():
    grid = WindowGrid(5, 4, 3, 2, 2)
    images = np.random.default_rng(0).integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    windows = grid.windows(images)
    assert grid.image_shape == (9, 6)
    assert windows.shape == (2, 3, 2, 5, 4)
    np.testing.assert_array_equal(windows[1, 2, 1], images[1, 4:9, 2:6])
    np.testing.assert_array_equal(grid.areas(images), windows.sum(axis=(3, 4)))


@pytest.mark.parametrize('values', [(0, 4, 1, 1, 1), (4, 4, 1, 0, 1), (4, 4, 1, 1, -1)])
def test_empty_grids_are_refused(values):
    with pytest.raises(InputError, match='positive'):
        WindowGrid(*values)


@pytest.mark.parametrize(
    'images',
    [np.zeros((1, 8, 6), np.uint8), np.zeros((1, 9, 6)), np.zeros((9, 6), np.uint8)],
)
def test_images_that_do_not_fit_are_refused(images):
    with pytest.raises(InputError, match='9, 6'):
        WindowGrid(5, 4, 3, 2, 2).windows(images)


@pytest.mark.parametrize(
    ('templates', 'words'),
    [
        (np.zeros((0, 5, 4), np.uint8), 'at least one'),
        (np.zeros((2, 5, 4)), 'uint8'),
        (np.zeros((2, 4, 5), np.uint8), '5 x 4'),
    ],
)
def test_templates_that_do_not_fit_are_refused(templates, words):
    with pytest.raises(InputError, match=words):
        EventKernel(templates, WindowGrid(5, 4, 3, 2, 2))
