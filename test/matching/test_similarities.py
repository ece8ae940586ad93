# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.placements import Sampled
from gait_segmentation.matching.similarities import SimilarityMaps
from gait_segmentation.matching.tanimoto import ReferenceKernel, WindowGrid, tanimoto
from gait_segmentation.matching.transitions import UNIT
from gait_segmentation.matching.visibility import LineSums

GRID = WindowGrid(7, 5, 3, 4, 2)
COST = np.array([30, 0], np.int16)
LEAST = 0.25


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
    found = similarities.update(Sampled(images, known), np.array([True, True]))
    found = found[kernels.row].reshape(3, 2, 2, -1)[..., : GRID.rows * GRID.columns]
    share, seen = expected(bank, images, known)
    share = np.where(seen < LEAST, 0.0, share)
    assert np.abs(found + COST[:, None] - UNIT * share).max() <= 0.51


@pytest.mark.parametrize('name', ['no mask', 'top cut', 'corner'])
def test_only_builds_that_are_searched_are_compared(name):
    bank, known = templates(), MASKS[name]
    kernels, similarities = maps(bank)
    every = similarities.update(Sampled(likelihoods(), known), np.array([True, True])).copy()
    kernels, similarities = maps(bank)
    found = similarities.update(Sampled(likelihoods(), known), np.array([False, True]))
    part = kernels.part(1)
    used = np.arange(2)[:, None] * kernels.pitch + np.arange(GRID.rows * GRID.columns)
    np.testing.assert_array_equal(found[part][:, used], every[part][:, used])
    assert not found[kernels.part(0)].any()


def test_templates_out_of_sight_are_like_nothing():
    bank = templates()
    kernels, similarities = maps(bank, least=1.0)
    images = np.full((2, *GRID.image_shape), 255, np.uint8)
    known = mask(slice(0, GRID.image_shape[0] - 1))
    found = similarities.update(Sampled(images, known), np.array([True, True]))
    found = found[kernels.row].reshape(3, 2, 2, -1)[..., : GRID.rows * GRID.columns]
    low = found[:, :, 1].reshape(3, 2, GRID.rows, GRID.columns)
    assert (low[:, :, -1] == 0).all()
    assert (low[:, :, 0] > 0).all()


@pytest.mark.parametrize('name', ['no mask', 'top cut', 'corner'])
@pytest.mark.parametrize('height', [0, 1])
def test_only_body_heights_that_are_searched_are_compared(name, height):
    bank, known = templates(), MASKS[name]
    kernels, similarities = maps(bank)
    both = np.array([True, True])
    every = similarities.update(Sampled(likelihoods(), known), both).copy()
    kernels, similarities = maps(bank)
    searched = slice(height, height + 1)
    found = similarities.update(Sampled(likelihoods(), known), both, searched)
    used = height * kernels.pitch + np.arange(GRID.rows * GRID.columns)
    np.testing.assert_array_equal(found[:, used], every[:, used])
    other = (1 - height) * kernels.pitch
    assert not found[:, other : other + kernels.pitch].any()
