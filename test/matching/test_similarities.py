# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from benchmarks.kernels import ReferenceKernel, tanimoto
from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.placements import Sampled
from gait_segmentation.matching.search_range import SearchRange
from gait_segmentation.matching.similarities import SimilarityMaps, filled_up
from gait_segmentation.matching.tanimoto import WindowGrid, pitch_of
from gait_segmentation.matching.transitions import UNIT
from gait_segmentation.matching.visibility import LineSums

GRID = WindowGrid(7, 5, 3, 4, 2)
COST = np.array([30, 0], np.int16)
LEAST = 0.25
ALL = SearchRange((0, 0, 0), (2, GRID.rows, GRID.columns))


def templates():
    return np.random.default_rng(0).integers(0, 256, (3, 2, 7, 5), dtype=np.uint8)


def likelihoods():
    shape = 2, *GRID.image_shape
    return np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)


def maps(bank, least=LEAST):
    kernels = BuildKernels(bank, np.array([1, 0, 1]), GRID)
    sums = LineSums(bank, kernels.row, kernels.rows)
    return kernels, SimilarityMaps(kernels, sums, GRID, COST, least)


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
    """Return similarities and shares in sight by the definition, (V, P, S, windows)."""
    flat = bank.reshape(-1, 7, 5)
    reference = ReferenceKernel(flat, GRID)
    whole = flat.sum(axis=(1, 2), dtype=np.int64)[:, None, None, None]
    seen = reference.common_area(mask() if known is None else known).astype(np.int64)
    share = tanimoto(reference.common_area(images), GRID.areas(images)[None], seen)
    shape = *bank.shape[:2], 2, GRID.rows * GRID.columns
    return share.reshape(shape), (seen / whole).reshape(shape)


@pytest.mark.parametrize('name', MASKS)
def test_similarities_are_those_of_the_definition(name):
    bank, known = templates(), MASKS[name]
    kernels, similarities = maps(bank)
    images = likelihoods() if known is None else np.minimum(likelihoods(), known)
    found = similarities.update(Sampled(images, known), np.array([True, True]), ALL)
    found = found[kernels.row][..., : ALL.size].reshape(3, 2, 2, -1)
    share, seen = expected(bank, images, known)
    share = np.where(seen < LEAST, 0.0, share)
    assert np.abs(found + COST[:, None] - UNIT * share).max() <= 0.51


@pytest.mark.parametrize('name', ['no mask', 'top cut', 'corner'])
def test_only_builds_that_are_searched_are_compared(name):
    bank, known = templates(), MASKS[name]
    kernels, similarities = maps(bank)
    sampled = Sampled(likelihoods(), known)
    every = similarities.update(sampled, np.array([True, True]), ALL).copy()
    kernels, similarities = maps(bank)
    found = similarities.update(sampled, np.array([False, True]), ALL)
    part = kernels.part(1)
    np.testing.assert_array_equal(found[part, : ALL.size], every[part, : ALL.size])
    assert not found[kernels.part(0)].any()


def test_templates_out_of_sight_are_like_nothing():
    bank = templates()
    kernels, similarities = maps(bank, least=1.0)
    images = np.full((2, *GRID.image_shape), 255, np.uint8)
    known = mask(slice(0, GRID.image_shape[0] - 1))
    found = similarities.update(Sampled(images, known), np.array([True, True]), ALL)
    found = found[kernels.row][..., : ALL.size].reshape(3, 2, 2, -1)
    low = found[:, :, 1].reshape(3, 2, GRID.rows, GRID.columns)
    assert (low[:, :, -1] == 0).all()
    assert (low[:, :, 0] > 0).all()


@pytest.mark.parametrize('name', ['no mask', 'top cut', 'left cut', 'differs by scale', 'corner'])
@pytest.mark.parametrize(
    ('first', 'shape'), [((1, 0, 0), (1, 3, 4)), ((0, 1, 2), (2, 2, 2)), ((0, 0, 1), (1, 1, 3))]
)
def test_only_placements_that_are_searched_are_compared(name, first, shape):
    bank, known = templates(), MASKS[name]
    _, similarities = maps(bank)
    sampled, both, part = (
        Sampled(likelihoods(), known),
        np.array([True, True]),
        SearchRange(first, shape),
    )
    every = similarities.update(sampled, both, ALL)[:, : ALL.size].copy()
    found = similarities.update(sampled, both, part)
    assert found.shape[1] == pitch_of(part.size)
    np.testing.assert_array_equal(found[:, : part.size], ALL.part(every, part))
    np.testing.assert_array_equal(
        filled_up(ALL.part(every, part))[:, : part.size], found[:, : part.size]
    )
    assert filled_up(ALL.part(every, part)).shape == found.shape


def test_rows_are_as_long_as_what_is_searched_whatever_was_before():
    bank, grid = templates(), WindowGrid(7, 5, 11, 13)
    kernels = BuildKernels(bank, np.array([1, 0, 1]), grid)
    sums = LineSums(bank, kernels.row, kernels.rows)
    similarities = SimilarityMaps(kernels, sums, grid, COST, LEAST)
    images = np.random.default_rng(1).integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    sampled, both = Sampled(images, None), np.array([True, True])
    every = SearchRange((0, 0, 0), (2, 11, 13))
    part = SearchRange((0, 3, 4), (2, 5, 6))
    whole = similarities.update(sampled, both, every)[:, : every.size].copy()
    found = similarities.update(sampled, both, part)
    assert found.shape[1] == pitch_of(part.size) < pitch_of(every.size)
    np.testing.assert_array_equal(found[:, : part.size], every.part(whole, part))


def test_nothing_is_like_nothing():
    bank = templates()
    bank[0, 1] = 0
    kernels, similarities = maps(bank)
    black = Sampled(np.zeros((2, *GRID.image_shape), np.uint8), None)
    found = similarities.update(black, np.array([True, True]), ALL)
    assert (found[kernels.row[0, 1], : ALL.size] + _costs() == 0).all()


def _costs():
    return np.repeat(COST, GRID.rows * GRID.columns)
