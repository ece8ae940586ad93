# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import pixel_affine
from gait_segmentation.tracking.background.resampling import resample

SHAPE = (90, 140)
EVERY = (slice(0, 90), slice(0, 140))


def scene() -> np.ndarray:
    small = np.random.default_rng(4).random((30, 45, 4)).astype(np.float32)
    return cv2.resize(100 * small, SHAPE[::-1], interpolation=cv2.INTER_CUBIC)


def turned(degrees: float, zoom: float = 1.0) -> np.ndarray:
    matrix = cv2.getRotationMatrix2D((60, 40), degrees, zoom)
    matrix[:, 2] += (3.3, -2.6)
    return matrix


@pytest.mark.parametrize(
    'motion', [turned(0), turned(0.05), turned(-0.1, 1.002), turned(3.0), turned(0, 1.2)]
)
def test_it_does_what_cubic_interpolation_does(motion: np.ndarray) -> None:
    image, out = np.abs(scene()), np.zeros((*SHAPE, 4), np.float32)
    resample(image, motion, 0.5, EVERY, out)
    true = cv2.warpAffine(image, pixel_affine(motion), SHAPE[::-1], flags=cv2.INTER_CUBIC)
    off = np.abs(out - np.maximum(0.5 * true, 0))
    # A run lies off its place by a 64th of a pixel at its ends.
    assert off[8:-8, 8:-8].max() < 0.5
    assert off.mean() < 0.05


def test_beyond_the_border_it_is_zero() -> None:
    out = np.full((*SHAPE, 4), 7, np.float32)
    shift = np.array([[1.0, 0, 20], [0, 1.0, -15]])
    resample(np.ones((*SHAPE, 4), np.float32), shift, 1.0, EVERY, out)
    assert not out[:, :20].any()
    assert not out[-15:].any()
    np.testing.assert_allclose(out[1:-17, 22:], 1, atol=1e-5)


def test_only_the_window_is_filled_in_and_nothing_is_below_zero() -> None:
    image = np.zeros((*SHAPE, 4), np.float32)
    image[:, 70:] = 50
    out = np.full((*SHAPE, 4), -1, np.float32)
    window = (slice(10, 33), slice(40, 120))
    resample(image, np.array([[1.0, 0, 0.4], [0, 1.0, 0]]), 1.0, window, out)
    assert out[window].min() == 0
    out[window] = -1
    assert (out == -1).all()


def test_an_empty_window_is_nothing_to_do() -> None:
    out = np.full((*SHAPE, 4), 7, np.float32)
    resample(scene(), turned(0), 1.0, (slice(5, 5), slice(0, 10)), out)
    assert (out == 7).all()
