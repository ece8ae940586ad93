# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.visibility import KnownLines, LineSums


def mask(rows=slice(None), columns=slice(None), value=255):
    known = np.full((2, 11, 9), 255 - value, np.uint8)
    known[:, rows, columns] = value
    return known


@pytest.mark.parametrize(
    ('known', 'axis', 'span'),
    [
        (mask(), 0, (0, 11)),
        (mask(value=0), 0, (0, 0)),
        (mask(slice(3, None)), 0, (3, 11)),
        (mask(slice(2, 8)), 0, (2, 8)),
        (mask(columns=slice(4, None)), 1, (4, 9)),
        (mask(columns=slice(0, 2)), 1, (0, 2)),
    ],
)
def test_whole_lines_are_found(known, axis, span):
    lines = KnownLines.of(known)
    assert lines.axis == axis
    assert lines.spans.tolist() == [list(span)] * 2


def test_each_image_has_lines_of_its_own():
    known = mask(slice(0, 6))
    known[1] = mask(slice(3, 9))[0]
    assert KnownLines.of(known).spans.tolist() == [[0, 6], [3, 9]]


@pytest.mark.parametrize(
    'known',
    [
        mask(slice(2, None), slice(0, 7)),
        mask(slice(2, 4), slice(3, 5), 0),
        mask(slice(4, 6), value=0),
        mask(columns=slice(4, 6), value=0),
        np.concatenate([mask(slice(3, None))[:1], mask(columns=slice(4, None))[:1]]),
    ],
)
def test_what_is_not_lines_is_none(known):
    assert KnownLines.of(known) is None


def test_sums_are_those_of_the_first_lines():
    templates = np.random.default_rng(0).integers(0, 256, (2, 2, 5, 3), dtype=np.uint8)
    row = np.array([[2, 0], [1, 2]], np.int32)
    templates[1, 1] = templates[0, 0]
    sums = LineSums(templates, row, 3)
    assert sums.whole[0] == templates[0, 1].sum()
    assert sums.over(0)[1, 3] == templates[1, 0, :3].sum()
    assert sums.over(1)[2, 1] == templates[0, 0, :, :1].sum()
