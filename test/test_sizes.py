# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.sizes import same_proportions, shrink


@pytest.mark.parametrize('channels', [(), (3,)])
def test_shrinking_by_powers_of_two_is_the_mean_over_areas(channels: tuple[int, ...]) -> None:
    image = np.random.default_rng(0).integers(0, 256, (32, 48, *channels), np.uint8)
    mean = image.reshape(8, 4, 12, 4, *channels).mean(axis=(1, 3))
    # Rounded once for each halving.
    assert np.abs(shrink(image, (8, 12)) - mean).max() <= 1


@pytest.mark.parametrize('shape', [(50, 70), (37, 52), (33, 47), (25, 35), (12, 17), (4, 5)])
def test_shrinking_keeps_places_and_does_not_alias(shape: tuple[int, int]) -> None:
    rows, columns = np.mgrid[0:101, 0:141]
    ramp = (rows + columns).astype(np.uint8)
    small = shrink(ramp, shape)
    assert small.shape == shape
    y, x = (np.arange(n) + 0.5 for n in shape)
    expected = (y * 101 / shape[0])[:, None] + x * 141 / shape[1] - 1
    # Odd sizes lose a row and a column at each halving, so less than a pixel of the result.
    assert np.abs(small - expected).max() < 101 / shape[0] + 141 / shape[1]
    stripes = np.where(columns % 2, 255, 0).astype(np.uint8)
    if shape[0] < 50:
        assert np.abs(shrink(stripes, shape).astype(int) - 127.5).max() < 2


def test_what_has_the_size_stays() -> None:
    image = np.zeros((5, 6, 3), np.uint8)
    assert shrink(image, (5, 6)) is image


@pytest.mark.parametrize(
    ('shape', 'source', 'same'),
    [
        ((240, 320), (480, 640), True),
        ((206, 367), (480, 854), True),
        ((1, 1), (1, 1), True),
        ((192, 1), (300, 1), True),
        ((1, 1), (3, 200), True),
        ((240, 330), (480, 640), False),
        ((10, 90), (160, 120), False),
        ((100, 100), (100, 103), False),
    ],
)
def test_sizes_are_compared_to_a_pixel(shape: tuple[int, int], source: tuple, same: bool) -> None:
    assert same_proportions(shape, source) == same
