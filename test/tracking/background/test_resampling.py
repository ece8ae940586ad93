# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.background.resampling import resample

SHAPE = (90, 140)
BEYOND = 60
EVERY = (slice(0, 90), slice(0, 140))


def scene() -> np.ndarray:
    small = np.random.default_rng(4).random((30, 45, 4)).astype(np.float32)
    return cv2.resize(100 * small, SHAPE[::-1], interpolation=cv2.INTER_CUBIC)


def turned(degrees: float, zoom: float = 1.0) -> np.ndarray:
    matrix = cv2.getRotationMatrix2D((60, 40), degrees, zoom)
    matrix[:, 2] += (3.3, -2.6)
    return matrix


def cubic(image: np.ndarray, motion: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """Return the image after a motion, taken a little beside: (h, w, 4) float64, by the book."""
    rows, columns = np.indices(SHAPE) + 0.5
    places = np.stack([columns, rows, np.ones(SHAPE)])
    x, y = np.einsum('ij,jrc->irc', cv2.invertAffineTransform(motion), places)
    x, y = x - 0.5 + dx, y - 0.5 + dy
    padded = np.pad(image.astype(float), ((BEYOND, BEYOND), (BEYOND, BEYOND), (0, 0)))
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((*SHAPE, 4))
    for down in range(-1, 3):
        for across in range(-1, 3):
            at = np.clip(top + down + BEYOND, 0, padded.shape[0] - 1)
            beside = np.clip(left + across + BEYOND, 0, padded.shape[1] - 1)
            weight = kernel(y - top - down) * kernel(x - left - across)
            total += weight[..., None] * padded[at, beside]
    return total


def kernel(distance: np.ndarray) -> np.ndarray:
    """Return Keys' cubic with the slope of OpenCV."""
    d, a = np.abs(distance), -0.75
    near = (a + 2) * d**3 - (a + 3) * d**2 + 1
    far = a * (d**3 - 5 * d**2 + 8 * d - 4)
    return np.where(d <= 1, near, np.where(d < 2, far, 0))


@pytest.mark.parametrize(
    'motion', [turned(0), turned(0.05), turned(-0.1, 1.002), turned(3.0), turned(0, 1.2)]
)
def test_it_does_what_cubic_interpolation_does(motion: np.ndarray) -> None:
    image, out = np.abs(scene()), np.zeros((*SHAPE, 4), np.float32)
    resample(image, motion, 0.5, EVERY, out)
    # A run lies off its place by a 64th of a pixel at its ends, and so do the pixels of
    # OpenCV 4, which rounds places to a 1024th of a pixel and then to a 32nd.
    off = 1 / 64 + 1 / 1024
    beside = [cubic(image, motion, dx, dy) for dx in (-off, 0, off) for dy in (-off, 0, off)]
    least, most = np.min(beside, axis=0), np.max(beside, axis=0)
    # Between places that are ``off`` apart a curve goes beyond them by an eighth of its bend times
    # the square of that, along each axis.  The bends of the four weights add up to zero, and
    # without their signs to 12 at most.
    beyond = 2 / 8 * off**2 * 12 / 2 * (image.max() - image.min())
    inner = (slice(8, -8), slice(8, -8))
    assert (out >= np.maximum(0.5 * (least - beyond), 0))[inner].all()
    assert (out <= np.maximum(0.5 * (most + beyond), 0))[inner].all()


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
