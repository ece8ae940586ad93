# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gait_segmentation.matching.common_areas import WindowGrid, splitting_ids
from gait_segmentation.matching.similarities import KERNELS
from test.matching.cases import banks, common_area, definition, windows_of


@pytest.mark.parametrize('name', KERNELS)
@settings(max_examples=120)
@given(case=banks())
def test_all_kernels_give_the_bits_of_the_definition(name, case):
    templates, images, grid = case
    kernel = KERNELS[name](templates, grid)
    found = common_area(kernel, images, grid)
    np.testing.assert_array_equal(found, definition(templates, images, grid))


@pytest.mark.parametrize('name', KERNELS)
def test_sums_beyond_16_bits_are_exact(name):
    grid = WindowGrid(96, 64, 3, 3, 1)
    templates = np.full((2, 96, 64), 255, np.uint8)
    templates[1] = 0
    templates[1, 0, 0] = 255
    images = np.full((1, *grid.image_shape), 255, np.uint8)
    common = common_area(KERNELS[name](templates, grid), images, grid)
    assert (common[0] == 96 * 64 * 255).all()
    assert (common[1] == 255).all()


@pytest.mark.parametrize('name', KERNELS)
@pytest.mark.parametrize(
    ('step', 'rows', 'columns'), [(1, 3, 4), (2, 1, 1), (2, 5, 19), (3, 2, 7)]
)
def test_only_some_windows_are_compared_in_memory_that_was_used_before(name, step, rows, columns):
    rng = np.random.default_rng(0)
    grid = WindowGrid(7, 5, rows, columns, step)
    kernel = KERNELS[name](rng.integers(1, 255, (2, 7, 5), np.uint8), grid)
    images = rng.integers(0, 256, (2, *grid.image_shape), np.uint8)
    every = common_area(kernel, images, grid)
    first, shape = (rows // 2, columns // 3), (2, rows - rows // 2, columns - columns // 3)
    matrix, out = kernel.new_matrix(), kernel.new_rows(np.prod(shape))
    for _ in range(2):
        found = kernel.common_rows(images, first, shape, matrix, out)
        assert np.shares_memory(found, out)
        found = found[kernel.row, : np.prod(shape)].reshape(2, *shape)
        np.testing.assert_array_equal(found, every[:, :, first[0] :, first[1] :])


def test_windows_and_their_areas():
    grid = WindowGrid(5, 4, 3, 2, 2)
    images = np.random.default_rng(0).integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    windows = windows_of(images, grid)
    assert windows.shape == (2, 3, 2, 5, 4)
    np.testing.assert_array_equal(windows[1, 2, 1], images[1][grid.part(2, 1)])
    np.testing.assert_array_equal(grid.areas(images), windows.sum(axis=(3, 4)))


@given(st.lists(st.integers(0, 255), min_size=1, max_size=40), st.data())
def test_the_second_splitting_id_cannot_matter(values, data):
    ascending = np.sort(np.array([values], np.uint8))
    lower, upper = splitting_ids(ascending)
    (ranks,) = ascending.astype(int)
    for v in {*values, data.draw(st.integers(0, 255))}:
        split = data.draw(st.integers(int(lower[0, v]), int(upper[0, v])))
        added = np.concatenate([ranks[:split], np.full(len(ranks) - split, v)])
        np.testing.assert_array_equal(added, np.minimum(ranks, v))
