# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import scaling
from gait_segmentation.images import check_image, check_stamp, signed_distance, warp_window


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
