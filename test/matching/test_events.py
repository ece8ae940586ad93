# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.matching.common_areas import WindowGrid
from gait_segmentation.matching.events import (
    EventKernel,
    grouped,
    make_program,
    minimum_arborescence,
)
from test.matching.cases import common_area, definition


@given(st.lists(st.integers(1, 255), max_size=60))
def test_no_two_groups_could_be_one(spans):
    span = np.array(spans, np.uint8)
    order, ends = grouped(span)
    assert sorted(order.tolist()) == list(range(len(span)))
    groups = np.split(span[order].astype(int), ends[:-1]) if len(ends) else []
    sums = sorted(int(group.sum()) for group in groups)
    assert all(0 < each <= 255 for each in sums)
    assert len(sums) < 2 or sums[0] + sums[1] > 255


def weight(pixels, parents):
    empty = np.zeros_like(pixels[0])
    return sum(
        int((row != (pixels[p] if p >= 0 else empty)).sum())
        for row, p in zip(pixels, parents, strict=True)
    )


def reaches_root(parents):
    for start in range(len(parents)):
        seen, node = set(), start
        while node >= 0:
            if node in seen:
                return False
            seen.add(node)
            node = parents[node]
    return True


def test_is_the_lightest_of_all_trees():
    rng = np.random.default_rng(3)
    for _ in range(5):
        pixels = rng.integers(0, 3, (4, 9)).astype(np.uint8)
        order, parents = minimum_arborescence(pixels)
        trees = itertools.product(range(-1, 4), repeat=4)
        best = min(weight(pixels, tree) for tree in trees if reaches_root(tree))
        assert weight(pixels, parents) == best
        place = {int(k): n for n, k in enumerate(order)}
        assert all(p < 0 or place[int(p)] < place[k] for k, p in enumerate(parents))


@pytest.mark.parametrize('size', [250, 260])
def test_templates_of_more_pixels_than_16_bits_can_count(size):
    rng = np.random.default_rng(3)
    templates = rng.integers(1, 256, (2, size, size), dtype=np.uint8)
    images = rng.integers(0, 256, (1, size, size), dtype=np.uint8)
    grid = WindowGrid(size, size, 1, 1)
    found = common_area(EventKernel(templates, grid), images, grid)
    np.testing.assert_array_equal(found, definition(templates, images, grid))


def test_finer_sampling_of_a_motion_hardly_adds_events():
    columns = np.arange(64)

    def events(count):
        centers = 32 + 20 * np.sin(2 * np.pi * np.arange(count) / count)
        inside = np.abs(columns - centers[:, None, None]) < 6
        moving = np.where(np.broadcast_to(inside, (count, 8, 64)), 255, 0).astype(np.uint8)
        return len(make_program(moving).source)

    assert events(960) <= 1.15 * events(60)
