# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import pixel_affine, scaling
from gait_segmentation.images import (
    bounding_box,
    check_image,
    check_map,
    check_stamp,
    shift_whole,
    signed_distance,
    warp_window,
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


@pytest.mark.parametrize('stamp', [0, -1])
def test_stamps_must_be_positive(stamp: int) -> None:
    with pytest.raises(InputError, match=f'positive nanoseconds, got {stamp}'):
        check_stamp(stamp)


def test_signed_distance_is_positive_inside() -> None:
    inside = np.zeros((21, 21), np.bool_)
    inside[8:13, :] = True
    distance = signed_distance(inside)
    # Three steps, by the chamfer metric of 3 x 3 pixels.
    assert distance[10, 10] == pytest.approx(3, rel=0.05)
    assert distance[7, 10] == pytest.approx(-1, rel=0.05)
    assert distance[0, 10] == pytest.approx(-8, rel=0.05)


@pytest.mark.parametrize('value', [True, False])
def test_without_an_edge_the_distance_is_the_diagonal(value: bool) -> None:
    distance = signed_distance(np.full((30, 40), value))
    assert distance == pytest.approx(np.full((30, 40), 50 if value else -50))


def test_a_window_of_a_warp_is_the_warps_window() -> None:
    image = np.random.default_rng(0).integers(0, 255, (40, 50), np.uint8)
    motion = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0]])
    window = (slice(10, 20), slice(15, 35))
    part = warp_window(image, motion, window)
    assert np.array_equal(part, image[12:22, 12:32])
    assert np.array_equal(warp_window(image, scaling(1), window), image[window])


@pytest.mark.parametrize('shape', [(5, 7), (5, 7, 2)])
@pytest.mark.parametrize('dx', [-9, -7, -2, 0, 3, 7])
@pytest.mark.parametrize('dy', [-5, -1, 0, 2, 6])
def test_what_a_shift_brings_in_is_zero(shape: tuple[int, ...], dx: int, dy: int) -> None:
    image = np.random.default_rng(0).integers(1, 255, shape).astype(np.uint8)
    moved = shift_whole(image, dx, dy)
    assert moved.shape == shape
    for row in range(shape[0]):
        for col in range(shape[1]):
            inside = 0 <= row - dy < shape[0] and 0 <= col - dx < shape[1]
            expected = image[row - dy, col - dx] if inside else np.zeros(shape[2:])
            assert np.array_equal(moved[row, col], expected)


@pytest.mark.parametrize(
    'array', [np.zeros((4, 5, 1), np.uint8), np.zeros((4, 5), np.float32), np.zeros(4, np.uint8)]
)
def test_what_has_not_one_byte_a_pixel_is_no_map(array: np.ndarray) -> None:
    check_map(np.zeros((4, 5), np.uint8), 'likelihood')
    with pytest.raises(InputError, match=r'^likelihood must be \(height, width\) uint8, got '):
        check_map(array, 'likelihood')


@pytest.mark.parametrize('border', [cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT])
@pytest.mark.parametrize(
    'motion',
    [
        [[1.0, 0.0, 3.3], [0.0, 1.0, -1.77]],
        [[1.002, 0.003, -5.1], [-0.003, 1.002, 2.7]],
        [[1.0, 0.0, 70.4], [0.0, 1.0, -90.6]],
        [[0.9, 0.1, 3.0], [-0.1, 0.9, 4.0]],
    ],
)
@pytest.mark.parametrize(
    'window',
    [(slice(20, 60), slice(30, 110)), (slice(0, 90), slice(0, 130)), (slice(80, 120),) * 2],
)
def test_a_window_is_warped_as_opencv_warps_it(
    window: tuple[slice, slice], motion: list[list[float]], border: int
) -> None:
    rng = np.random.default_rng(5)
    image = cv2.GaussianBlur(rng.integers(0, 256, (90, 130), np.uint8), (0, 0), 1)
    matrix = pixel_affine(np.array(motion))
    matrix[:, 2] -= (window[1].start, window[0].start)
    size = (window[1].stop - window[1].start, window[0].stop - window[0].start)
    expected = cv2.warpAffine(image, matrix, size, borderMode=border)
    part = warp_window(image, np.array(motion), window, border)
    assert part.shape == expected.shape
    # OpenCV may round places to parts of a pixel.
    assert cv2.absdiff(part, expected).max() <= 3
    assert np.mean(part != expected) < 0.3


@pytest.mark.parametrize('density', [0.0, 0.001, 0.5])
def test_the_bounds_are_those_of_opencv(density: float) -> None:
    rng = np.random.default_rng(7)
    for shape in ((1, 1), (7, 40), (60, 33)):
        mask = np.where(rng.random(shape) < density, 255, 0).astype(np.uint8)
        assert bounding_box(mask) == cv2.boundingRect(mask)
        assert bounding_box(mask[1:, 2:]) == (
            cv2.boundingRect(mask[1:, 2:]) if mask[1:, 2:].size else (0, 0, 0, 0)
        )
