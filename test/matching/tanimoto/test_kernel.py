# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings

from gait_segmentation.matching.tanimoto import KERNELS, ReferenceKernel, WindowGrid
from test.matching.tanimoto.cases import banks

OTHERS = [name for name in KERNELS if name != 'reference']


@pytest.mark.parametrize('name', OTHERS)
@settings(max_examples=120)
@given(case=banks())
def test_all_give_the_same_bits(name, case):
    templates, images, grid = case
    expected = ReferenceKernel(templates, grid).common_area(images)
    kernel = KERNELS[name](templates, grid)
    np.testing.assert_array_equal(kernel.common_area(images), expected)
    np.testing.assert_array_equal(kernel.common_area(images), expected)


@pytest.mark.parametrize('name', KERNELS)
def test_sums_beyond_16_bits_are_exact(name):
    grid = WindowGrid(96, 64, 3, 3, 1)
    templates = np.full((2, 96, 64), 255, np.uint8)
    templates[1] = 0
    templates[1, 0, 0] = 255
    images = np.full((1, *grid.image_shape), 255, np.uint8)
    common = KERNELS[name](templates, grid).common_area(images)
    assert (common[0] == 96 * 64 * 255).all()
    assert (common[1] == 255).all()


@pytest.mark.parametrize('name', KERNELS)
@pytest.mark.parametrize(
    ('step', 'rows', 'columns'), [(1, 3, 4), (2, 1, 1), (2, 5, 19), (3, 2, 7)]
)
def test_only_some_windows_are_compared_in_memory_that_is_given(name, step, rows, columns):
    rng = np.random.default_rng(0)
    grid = WindowGrid(7, 5, rows, columns, step)
    kernel = KERNELS[name](rng.integers(1, 255, (2, 7, 5), np.uint8), grid)
    images = rng.integers(0, 256, (2, *grid.image_shape), np.uint8)
    every = kernel.common_area(images)
    first, shape = (rows // 2, columns // 3), (2, rows - rows // 2, columns - columns // 3)
    matrix, out = kernel.new_matrix(), kernel.new_rows(np.prod(shape))
    found = kernel.common_rows(images, first, shape, matrix, out)
    assert np.shares_memory(found, out)
    found = found[kernel.row, : np.prod(shape)].reshape(2, *shape)
    np.testing.assert_array_equal(found, every[:, :, first[0] :, first[1] :])
    again = kernel.common_rows(images, first, shape, matrix, out)
    np.testing.assert_array_equal(again[kernel.row, : np.prod(shape)].reshape(found.shape), found)


@pytest.mark.parametrize('name', KERNELS)
def test_equal_templates_share_a_row(name):
    rng = np.random.default_rng(2)
    templates = rng.integers(0, 256, (3, 6, 5), dtype=np.uint8)
    twice = KERNELS[name](np.concatenate([templates, templates]), WindowGrid(6, 5, 2, 2))
    assert twice.rows == 3
    assert (twice.row[:3] == twice.row[3:]).all()
    assert sorted(twice.row[:3].tolist()) == [0, 1, 2]
