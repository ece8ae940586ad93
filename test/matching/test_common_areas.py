# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.common_areas import WindowGrid, pitch_of, splitting_ids
from gait_segmentation.matching.events import (
    EventKernel,
    grouped,
    make_program,
    minimum_arborescence,
)
from gait_segmentation.matching.path import UNIT
from gait_segmentation.matching.placements import Sampled, SearchRange
from gait_segmentation.matching.similarities import KERNELS, SimilarityMaps, coded_bank
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


GRID = WindowGrid(7, 5, 3, 4, 2)
COST = np.array([30, 0], np.int16)
ALL = SearchRange((0, 0, 0), (2, GRID.rows, GRID.columns))


def templates():
    return np.random.default_rng(0).integers(0, 256, (3, 2, 7, 5), dtype=np.uint8)


def likelihoods():
    shape = 2, *GRID.image_shape
    return np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)


def of_builds(templates):
    """Return a bank of three views of two builds."""
    return TemplateBank(templates, np.arange(3, dtype=np.float32), ('b', 'a', 'b'), 0.9)


def maps(bank, kernel='events'):
    _, coded = coded_bank(of_builds(bank), 256, GRID, kernel)
    return coded, SimilarityMaps(coded, GRID, COST)


def mask(rows=slice(None), columns=slice(None), value=255):
    known = np.full((2, *GRID.image_shape), 255 - value, np.uint8)
    known[:, rows, columns] = value
    return known


def mixed():
    known = mask(slice(0, 6))
    known[1] = mask(slice(3, 9))[0]
    return known


MASKS = {
    'no mask': None,
    'all': mask(),
    'none': mask(value=0),
    'top cut': mask(slice(3, None)),
    'bottom cut': mask(slice(0, 6)),
    'both': mask(slice(2, 8)),
    'left cut': mask(columns=slice(4, None)),
    'right cut': mask(columns=slice(0, 2)),
    'differs by scale': mixed(),
    'corner': mask(slice(2, None), slice(0, 7)),
    'hole': mask(slice(2, 4), slice(3, 5), 0),
    'bar across': mask(slice(4, 6), value=0),
}


def expected(bank, images, known):
    """Return similarities by the definition, (V, P, S, windows)."""
    flat = bank.reshape(-1, 7, 5)
    seen = definition(flat, mask() if known is None else known, GRID).astype(np.int64)
    common = definition(flat, images, GRID)
    union = GRID.areas(images)[None] + seen - common
    share = np.where(union > 0, common / np.maximum(union, 1), 0.0)
    shape = *bank.shape[:2], 2, GRID.rows * GRID.columns
    return share.reshape(shape)


@pytest.mark.parametrize('kernel', KERNELS)
@pytest.mark.parametrize('name', MASKS)
def test_similarities_are_those_of_the_definition(name, kernel):
    bank, known = templates(), MASKS[name]
    coded, similarities = maps(bank, kernel)
    images = likelihoods() if known is None else np.minimum(likelihoods(), known)
    found = similarities.update(Sampled(images, known), ALL)
    found = found[coded.row, : ALL.size].reshape(3, 2, 2, -1)
    share = expected(bank, images, known)
    assert np.abs(found + COST[:, None] - UNIT * share).max() <= 0.51


@pytest.mark.parametrize('kernel', KERNELS)
@pytest.mark.parametrize('name', ['no mask', 'left cut', 'differs by scale', 'corner'])
@pytest.mark.parametrize(
    ('first', 'shape'), [((1, 0, 0), (1, 3, 4)), ((0, 1, 2), (2, 2, 2)), ((0, 0, 1), (1, 1, 3))]
)
def test_only_placements_that_are_searched_are_compared(name, first, shape, kernel):
    _, similarities = maps(templates(), kernel)
    sampled, part = Sampled(likelihoods(), MASKS[name]), SearchRange(first, shape)
    lanes = [ALL.lane(*part.place(lane)) for lane in range(part.size)]
    every = similarities.update(sampled, ALL)[:, lanes]
    # The second time in memory that was used before.
    for _ in range(2):
        found = similarities.update(sampled, part)
        assert found.shape[1] == pitch_of(part.size)
        np.testing.assert_array_equal(found[:, : part.size], every)


def test_a_bank_is_coded_once_and_equal_templates_share_a_row():
    bank = templates()
    bank[2, 1] = bank[0, 0]
    kept = of_builds(bank)
    _, coded = coded_bank(kept, 256, GRID, 'events')
    assert coded_bank(kept, 256, GRID, 'events')[1] is coded
    assert coded.rows == 5
    assert coded.row[5] == coded.row[0]
    assert (coded.area[coded.row] == bank.reshape(6, -1).sum(axis=1)).all()


def test_templates_are_kept_if_they_have_so_few_levels():
    bank = of_builds(templates() // 128 * 255)
    assert coded_bank(bank, 2, GRID, 'events')[0] is bank.templates
    fine = of_builds(templates())
    assert len(np.unique(coded_bank(fine, 2, GRID, 'events')[0])) == 2
    assert (coded_bank(fine, 256, GRID, 'events')[0] == fine.templates).all()


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
