# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import itertools

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.images import (
    axis_tilt,
    check_image,
    check_map,
    inner_range,
    median,
    quantiles,
    same_proportions,
    shifted_part,
    shrink,
    signed_distance,
    tanimoto,
)


@pytest.mark.parametrize(
    'image',
    [
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((4, 4, 3), np.float32),
        np.zeros((0, 4, 3), np.uint8),
        None,
    ],
)
def test_what_is_no_bgr_image_is_refused(image: object) -> None:
    with pytest.raises(InputError):
        check_image(image)  # type: ignore[arg-type]


def test_of_a_frame_that_is_not_there_it_is_said_where_such_come_from() -> None:
    with pytest.raises(InputError, match='got None, as of a frame that cannot be read'):
        check_image(None)  # type: ignore[arg-type]


def test_signed_distance_is_positive_inside_and_the_diagonal_without_an_edge() -> None:
    inside = np.zeros((21, 21), np.bool_)
    inside[8:13, :] = True
    distance = signed_distance(inside)
    # Three steps, by the chamfer metric of 3 x 3 pixels.
    assert distance[10, 10] == pytest.approx(3, rel=0.05)
    assert distance[7, 10] == pytest.approx(-1, rel=0.05)
    assert distance[0, 10] == pytest.approx(-8, rel=0.05)
    for value, expected in ((True, 50), (False, -50)):
        distance = signed_distance(np.full((30, 40), value))
        assert distance == pytest.approx(np.full((30, 40), expected))


@pytest.mark.parametrize('shape', [(5, 7), (5, 7, 2)])
def test_what_a_shift_brings_in_is_zero(shape: tuple[int, ...]) -> None:
    image = np.random.default_rng(0).integers(1, 255, shape).astype(np.uint8)
    wide = np.zeros((25, 27, *shape[2:]), np.uint8)
    wide[10:15, 10:17] = image
    window = np.s_[1:4, 2:7]
    for dx, dy in itertools.product((-9, -7, -2, 0, 3, 7), (-5, -1, 0, 2, 6)):
        moved = shifted_part(image, dx, dy, np.s_[0:5, 0:7])
        np.testing.assert_array_equal(moved, wide[10 - dy : 15 - dy, 10 - dx : 17 - dx])
        if image.ndim == 2:
            part = shifted_part(image, dx, dy, window)
            np.testing.assert_array_equal(part, moved[window])


@pytest.mark.parametrize(
    'array', [np.zeros((4, 5, 1), np.uint8), np.zeros((4, 5), np.float32), np.zeros(4, np.uint8)]
)
def test_what_has_not_one_byte_a_pixel_is_no_map(array: np.ndarray) -> None:
    check_map(np.zeros((4, 5), np.uint8), 'likelihood')
    with pytest.raises(InputError, match='likelihood must be'):
        check_map(array, 'likelihood')


@pytest.mark.parametrize('shape', [(50, 70), (33, 47), (25, 35), (4, 5)])
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


@pytest.mark.parametrize(
    ('shape', 'source', 'same'),
    [
        ((240, 320), (480, 640), True),
        ((206, 367), (480, 854), True),
        ((1, 1), (1, 1), True),
        ((192, 1), (300, 1), True),
        ((1, 1), (3, 200), True),
        ((2, 100), (24, 996), True),
        ((240, 330), (480, 640), False),
        ((2, 100), (24, 300), False),
        ((10, 90), (160, 120), False),
        ((100, 100), (100, 103), False),
    ],
)
def test_sizes_are_compared_to_a_pixel(shape: tuple[int, int], source: tuple, same: bool) -> None:
    assert same_proportions(shape, source) == same


@pytest.mark.parametrize('count', [1, 2, 7, 50])
def test_medians_and_quantiles_are_those_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).normal(size=(count, 3)).astype(np.float32)
    np.testing.assert_array_equal(median(values), np.median(values, axis=0))
    assert median(values[:, 0]) == np.median(values[:, 0])
    shares = (0.005, 0.5, 0.995)
    assert quantiles(values[:, 0], shares) == pytest.approx(np.quantile(values[:, 0], shares))


def test_a_tilt_is_positive_to_the_right() -> None:
    rows, columns = np.mgrid[:60, :60]
    leaning = (np.abs(columns - 30 + (rows - 30) * 0.2) < 4).astype(np.uint8)
    assert axis_tilt(leaning) == pytest.approx(np.arctan(0.2), abs=0.02)


def test_the_ends_of_a_range_are_where_a_share_of_the_counts_is_passed() -> None:
    counts = np.array([0, 1, 50, 0, 48, 1, 0])
    assert inner_range(counts, 0.005) == (1, 6)
    assert inner_range(counts, 0.02) == (2, 5)


def test_similarity_is_what_two_have_in_common_over_what_either_has() -> None:
    shapes = np.zeros((3, 2, 4, 6), np.uint8)
    shapes[1, 0, :, :3] = 200
    shape = np.zeros((4, 6), np.uint8)
    shape[:, :4] = 100
    found = tanimoto(shapes, shape)
    assert found.shape == (3, 2)
    assert found[1, 0] == pytest.approx(300 / 700)
    assert np.count_nonzero(found) == 1
    assert tanimoto(shape, shape) == 1
