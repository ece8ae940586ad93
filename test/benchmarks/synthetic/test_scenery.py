# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from benchmarks.synthetic.scenery import (
    make_panorama,
    muted_colour,
    value_noise,
)


def test_colours_are_muted():
    rng = np.random.default_rng(0)
    colours = np.array([muted_colour(rng, (0.1, 0.4), (0.3, 0.8)) for _ in range(100)])
    highest, lowest = colours.max(axis=1), colours.min(axis=1)
    assert ((highest - lowest) / highest).max() <= 0.41
    assert highest.min() >= 0.29 * 255
    assert highest.max() <= 0.81 * 255


@pytest.mark.parametrize('shape', [(40, 60), (3, 5), (1, 7)])
def test_noise_is_normalised(shape):
    noise = value_noise(np.random.default_rng(1), shape, 16)
    assert noise.shape == shape
    assert noise.dtype == np.float32
    assert abs(noise.mean()) < 1e-4
    assert noise.std() == pytest.approx(1, abs=1e-3)


def test_clutter_adds_edges():
    def edges(clutter):
        picture = make_panorama(np.random.default_rng(2), (120, 300), 80, 60, clutter)
        assert picture.shape == (120, 300, 3)
        return (cv2.Canny(picture, 60, 120) > 0).mean()

    assert edges(1.0) > 2 * edges(0.0)
