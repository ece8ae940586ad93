# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import pixel_affine, scaling
from gait_segmentation.warping import warp_window


def test_a_window_of_a_warp_is_the_warps_window() -> None:
    image = np.random.default_rng(0).integers(0, 255, (40, 50), np.uint8)
    motion = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0]])
    window = (slice(10, 20), slice(15, 35))
    part = warp_window(image, motion, window)
    assert np.array_equal(part, image[12:22, 12:32])
    assert np.array_equal(warp_window(image, scaling(1), window), image[window])


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
