# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.tanimoto import ReferenceKernel, WindowGrid
from gait_segmentation.matching.visibility import VisibleAreas

GRID = WindowGrid(7, 5, 3, 4, 2)
OF_SEQUENCE = np.array([1, 0, 1])


def templates():
    return np.random.default_rng(0).integers(0, 256, (3, 2, 7, 5), dtype=np.uint8)


def mask(rows=slice(None), columns=slice(None), value=255):
    known = np.full((2, *GRID.image_shape), 255 - value, np.uint8)
    known[:, rows, columns] = value
    return known


def mixed():
    known = mask(slice(0, 6))
    known[1] = mask(slice(3, 9))[0]
    return known


MASKS = {
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


@pytest.mark.parametrize('name', MASKS)
def test_areas_are_those_of_the_definition(name):
    bank = templates()
    kernels = BuildKernels(bank, OF_SEQUENCE, GRID)
    areas = VisibleAreas(kernels, bank, GRID)
    found = areas.rows(MASKS[name], np.array([True, True]), OF_SEQUENCE)
    expected = ReferenceKernel(bank.reshape(-1, 7, 5), GRID).common_area(MASKS[name])
    shown = found[:, kernels.row.reshape(-1), :12].swapaxes(0, 1).reshape(expected.shape)
    np.testing.assert_array_equal(shown, expected)


@pytest.mark.parametrize('name', ['top cut', 'corner'])
def test_one_build_alone_is_enough(name):
    bank = templates()
    kernels = BuildKernels(bank, OF_SEQUENCE, GRID)
    areas = VisibleAreas(kernels, bank, GRID)
    found = areas.rows(MASKS[name], np.array([False, True]), OF_SEQUENCE)
    expected = ReferenceKernel(bank[[0, 2]].reshape(-1, 7, 5), GRID).common_area(MASKS[name])
    shown = found[:, kernels.row[[0, 2]].reshape(-1), :12].swapaxes(0, 1)
    np.testing.assert_array_equal(shown.reshape(expected.shape), expected)
    assert not found[:, kernels.row[1]].any()
