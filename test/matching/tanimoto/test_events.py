# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.tanimoto import EventKernel, ReferenceKernel, WindowGrid


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


def test_finer_sampling_of_a_motion_hardly_adds_events():
    columns = np.arange(64)

    def moving(count):
        centers = 32 + 20 * np.sin(2 * np.pi * np.arange(count) / count)
        inside = np.abs(columns - centers[:, None, None]) < 6
        return np.where(np.broadcast_to(inside, (count, 8, 64)), 255, 0).astype(np.uint8)

    few, many = (EventKernel(moving(k), WindowGrid(8, 64, 1, 1)).events for k in (60, 960))
    assert many <= 1.15 * few
