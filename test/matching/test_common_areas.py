# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later

import platform
import re

import numpy as np
import pytest
from hypothesis import given, settings
from numba import njit

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.common_areas import UNIT, SimilarityMaps
from gait_segmentation.matching.events import _run_program, make_program
from gait_segmentation.matching.matcher import KERNELS, coded_bank
from gait_segmentation.matching.placements import Sampled, SearchRange, WindowGrid
from test.matching.cases import banks, common_area, definition


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
    found = similarities.compare(Sampled(images, known), ALL)
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
    lanes = np.arange(ALL.size).reshape(ALL.shape)[part.slices].ravel()
    every = similarities.compare(sampled, ALL)[:, lanes]
    # The second time in memory that was used before.
    for _ in range(2):
        found = similarities.compare(sampled, part)
        assert found.shape[1] == part.pitch
        np.testing.assert_array_equal(found[:, : part.size], every)


def test_templates_are_kept_if_they_have_so_few_levels():
    bank = of_builds(templates() // 128 * 255)
    assert coded_bank(bank, 2, GRID, 'events')[0] is bank.templates
    fine = of_builds(templates())
    assert len(np.unique(coded_bank(fine, 2, GRID, 'events')[0])) == 2
    assert (coded_bank(fine, 256, GRID, 'events')[0] == fine.templates).all()


def test_events_are_added_in_vectors_of_bytes():
    code = njit(_run_program.py_func)
    code.compile(_run_program.signatures[0])
    (assembly,) = code.inspect_asm().values()
    # Of a difference that stays at 0: x86, ARM.
    assert re.search('psubusb|uqsub', assembly), platform.machine()


def test_finer_sampling_of_a_motion_hardly_adds_events():
    columns = np.arange(64)

    def events(count):
        centers = 32 + 20 * np.sin(2 * np.pi * np.arange(count) / count)
        inside = np.abs(columns - centers[:, None, None]) < 6
        moving = np.where(np.broadcast_to(inside, (count, 8, 64)), 255, 0).astype(np.uint8)
        return len(make_program(moving).source)

    assert events(960) <= 1.15 * events(60)
