# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.features.pool import NEUTRAL, POOL, View

NAMED = {feature.name: feature for feature in POOL}
COLOURS = np.zeros((8, 12, 3), np.uint8)
COLOURS[:, :4] = (200, 100, 50)
COLOURS[:, 4:8] = (100, 50, 25)
COLOURS[:, 8:] = (90, 90, 90)


def view(bgr: np.ndarray, step: int = 1) -> View:
    return View(bgr, cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY), step=step)


def places(name: str, seen: View) -> np.ndarray:
    return NAMED[name].places(seen)


def orientation(seen: View) -> np.ndarray:
    return NAMED['orientation'].planes(seen)[0]


def test_the_pool_has_colour_spaces_and_orientation() -> None:
    assert set(NAMED) == {'RGB', 'HSV', 'rg', 'HS', 'orientation'}


@pytest.mark.parametrize('name', list(NAMED))
@pytest.mark.parametrize('step', [1, 2])
def test_places_are_bins_of_the_pixels_needed(name: str, step: int) -> None:
    result = places(name, view(COLOURS, step))
    assert result.dtype == np.uint16
    assert result.max() < NAMED[name].bins
    assert np.array_equal(result, places(name, view(COLOURS))[::step, ::step])


def test_a_bin_holds_the_highest_bits_of_every_plane() -> None:
    blue, green, red = (int(value) >> 5 for value in COLOURS[0, 0])
    assert places('RGB', view(COLOURS))[0, 0] == (blue << 6) + (green << 3) + red


def test_chromaticity_does_not_depend_on_brightness() -> None:
    result = places('rg', view(COLOURS))
    assert result[0, 0] == result[0, 5] != result[0, 10]


def stripes(angle: float, sign: float = 1.0) -> np.ndarray:
    y, x = np.mgrid[0:40, 0:40].astype(np.float32)
    wave = np.sin((np.cos(angle) * x + np.sin(angle) * y) * 2 * np.pi / 9)
    return cv2.cvtColor(np.uint8(128 + sign * 80 * wave), cv2.COLOR_GRAY2BGR)


def test_orientation_is_that_of_stripes_whichever_side_is_lighter() -> None:
    upright, lying = (int(orientation(view(stripes(a)))[20, 20]) for a in (0.2, 1.4))
    expected = 247 / np.pi * (1.4 - 0.2)
    assert abs(lying - upright) == pytest.approx(expected, abs=3)
    inverted = orientation(view(stripes(0.2, -1.0)))
    assert int(inverted[20, 20]) == pytest.approx(upright, abs=2)


@pytest.mark.parametrize('shape', [(40, 53), (3, 3), (7, 2)])
@pytest.mark.parametrize('step', [1, 2])
def test_orientation_is_that_of_the_structure_tensor(shape: tuple[int, int], step: int) -> None:
    rng = np.random.default_rng(2)
    gray = cv2.GaussianBlur(rng.integers(0, 256, shape, np.uint8), (0, 0), 0.7)
    dx = cv2.Sobel(gray, cv2.CV_64F, 1, 0, ksize=3, scale=1 / 8)
    dy = cv2.Sobel(gray, cv2.CV_64F, 0, 1, ksize=3, scale=1 / 8)
    real, imaginary = (cv2.blur(part, (5, 5)) for part in (dx * dx - dy * dy, 2 * dx * dy))
    expected = 8 + 247 * (np.arctan2(imaginary, real) / (2 * np.pi) % 1)
    expected[np.hypot(real, imaginary) < 150] = NEUTRAL
    seen = View(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR), gray, step=step)
    off = np.abs(orientation(seen) - expected[::step, ::step])
    assert np.all(np.minimum(off, 247 - off) <= 1.1)


def test_a_plain_surface_has_no_orientation() -> None:
    plain = np.full((40, 40, 3), 90, np.uint8)
    assert np.all(orientation(view(plain)) == NEUTRAL)
