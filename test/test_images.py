# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.images import (
    bounding_box,
    check_image,
    check_map,
    check_stamp,
    overlap,
    placed,
    shift_whole,
    shifted_part,
    signed_distance,
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
    with pytest.raises(InputError, match='image must'):
        check_image(image)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ('stamp', 'said'),
    [
        (0, 'positive nanoseconds, got 0'),
        (-1, 'positive nanoseconds, got -1'),
        (0.033, 'whole nanoseconds, got 0.033'),
        ('7', "whole nanoseconds, got '7'"),
        (None, 'whole nanoseconds, got None'),
    ],
)
def test_stamps_must_be_positive_integers(stamp: object, said: str) -> None:
    check_stamp(np.int64(7))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=said):
        check_stamp(stamp)  # type: ignore[arg-type]


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
    window = (slice(1, 4), slice(2, 7))
    for dx, dy in itertools.product((-9, -7, -2, 0, 3, 7), (-5, -1, 0, 2, 6)):
        moved = shift_whole(image, dx, dy)
        np.testing.assert_array_equal(moved, wide[10 - dy : 15 - dy, 10 - dx : 17 - dx])
        if image.ndim == 2:
            part = shifted_part(image, dx, dy, window)
            np.testing.assert_array_equal(part, moved[window])


def test_a_part_is_placed_in_an_empty_image() -> None:
    window = (slice(1, 3), slice(2, 5))
    image = placed(np.ones((2, 3), np.uint8), window, (4, 6))
    assert image.shape == (4, 6)
    assert image.sum() == image[window].sum() == 6


@pytest.mark.parametrize(
    'array', [np.zeros((4, 5, 1), np.uint8), np.zeros((4, 5), np.float32), np.zeros(4, np.uint8)]
)
def test_what_has_not_one_byte_a_pixel_is_no_map(array: np.ndarray) -> None:
    check_map(np.zeros((4, 5), np.uint8), 'likelihood')
    with pytest.raises(InputError, match=r'^likelihood must be \(height, width\) uint8, got '):
        check_map(array, 'likelihood')
    with pytest.raises(InputError, match='likelihood must be an array, got list'):
        check_map([array], 'likelihood')  # type: ignore[arg-type]


@pytest.mark.parametrize('density', [0.0, 0.001, 0.5])
def test_the_bounds_are_those_of_opencv(density: float) -> None:
    rng = np.random.default_rng(7)
    for shape in ((1, 1), (7, 40), (60, 33)):
        mask = np.where(rng.random(shape) < density, 255, 0).astype(np.uint8)
        assert bounding_box(mask) == cv2.boundingRect(mask)
        assert bounding_box(mask[1:, 2:]) == (
            cv2.boundingRect(mask[1:, 2:]) if mask[1:, 2:].size else (0, 0, 0, 0)
        )


@pytest.mark.parametrize('shape', [(40, 53), (64, 64), (1, 2000), (2000, 1), (33, 512)])
def test_few_pixels_and_parts_of_masks_are_bounded(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    for count in range(4):
        for _ in range(50):
            mask = np.zeros(shape, np.uint8)
            mask.reshape(-1)[rng.integers(0, mask.size, count)] = rng.integers(1, 256)
            for part in (mask, mask.T, mask[::-1, ::2], mask[:, :1]):
                assert bounding_box(part) == cv2.boundingRect(np.ascontiguousarray(part))


def test_windows_overlap_in_what_they_share() -> None:
    one, two = (slice(0, 10), slice(5, 20)), (slice(4, 30), slice(0, 9))
    assert overlap(one, two) == (slice(4, 10), slice(5, 9))
    assert overlap(one, (slice(0, 10), slice(20, 30))) is None
