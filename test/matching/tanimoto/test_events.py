# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings

from benchmarks.kernels import ReferenceKernel
from gait_segmentation.matching.tanimoto import EventKernel, WindowGrid, polyphase
from test.matching.tanimoto.cases import banks


@settings(max_examples=120)
@given(banks())
def test_equals_the_reference(case):
    templates, images, grid = case
    expected = ReferenceKernel(templates, grid).common_area(images)
    kernel = EventKernel(templates, grid)
    np.testing.assert_array_equal(kernel.common_area(images), expected)
    np.testing.assert_array_equal(kernel.common_area(images), expected)


def test_sums_beyond_16_bits_are_exact():
    grid = WindowGrid(96, 64, 3, 3, 1)
    templates = np.full((2, 96, 64), 255, np.uint8)
    templates[1] = 0
    templates[1, 0, 0] = 255
    images = np.full((1, *grid.image_shape), 255, np.uint8)
    common = EventKernel(templates, grid).common_area(images)
    assert (common[0] == 96 * 64 * 255).all()
    assert (common[1] == 255).all()


def test_more_windows_than_one_block():
    grid = WindowGrid(6, 5, 17, 33, 2)
    rng = np.random.default_rng(1)
    templates = rng.integers(0, 256, (4, 6, 5), dtype=np.uint8)
    images = rng.integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    np.testing.assert_array_equal(
        EventKernel(templates, grid).common_area(images),
        ReferenceKernel(templates, grid).common_area(images),
    )


@pytest.mark.parametrize('size', [250, 260])
def test_templates_of_more_pixels_than_16_bits_can_count(size):
    rng = np.random.default_rng(3)
    templates = rng.integers(1, 256, (2, size, size), dtype=np.uint8)
    images = rng.integers(0, 256, (1, size, size), dtype=np.uint8)
    grid = WindowGrid(size, size, 1, 1)
    np.testing.assert_array_equal(
        EventKernel(templates, grid).common_area(images),
        ReferenceKernel(templates, grid).common_area(images),
    )


def test_equal_templates_cost_nothing():
    rng = np.random.default_rng(2)
    templates = rng.integers(0, 256, (3, 6, 5), dtype=np.uint8)
    grid = WindowGrid(6, 5, 2, 2)
    once = EventKernel(templates, grid)
    twice = EventKernel(np.concatenate([templates, templates]), grid)
    assert once.events == twice.events
    assert len(np.unique(twice.row)) == 3


def test_finer_sampling_of_a_motion_hardly_adds_events():
    columns = np.arange(64)

    def moving(count):
        centers = 32 + 20 * np.sin(2 * np.pi * np.arange(count) / count)
        inside = np.abs(columns - centers[:, None, None]) < 6
        return np.where(np.broadcast_to(inside, (count, 8, 64)), 255, 0).astype(np.uint8)

    few, many = (EventKernel(moving(k), WindowGrid(8, 64, 1, 1)).events for k in (60, 960))
    assert many <= 1.15 * few


@pytest.mark.parametrize(
    ('step', 'rows', 'columns'), [(1, 3, 4), (2, 1, 1), (2, 5, 19), (3, 2, 7)]
)
def test_only_some_windows_are_compared_in_memory_that_is_given(step, rows, columns):
    rng = np.random.default_rng(0)
    grid = WindowGrid(7, 5, rows, columns, step)
    kernel = EventKernel(rng.integers(1, 255, (2, 7, 5), np.uint8), grid)
    images = rng.integers(0, 256, (2, *grid.image_shape), np.uint8)
    every = kernel.common_area(images)
    first, shape = (rows // 2, columns // 3), (2, rows - rows // 2, columns - columns // 3)
    matrix, out = kernel.new_matrix(), kernel.new_rows(np.prod(shape))
    found = kernel.common_rows(polyphase(images, grid), first, shape, matrix, out)
    assert np.shares_memory(found, out)
    found = found[kernel.row, : np.prod(shape)].reshape(2, *shape)
    np.testing.assert_array_equal(found, every[:, :, first[0] :, first[1] :])
    assert np.shares_memory(
        kernel.common_rows(polyphase(images, grid), first, shape, matrix, out), out
    )
