# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What a known place looks like in the light of a frame: shadows, beams, clouds.

Light changes the lightness of a surface and its chroma by one factor g, which is about the same
all over a small square, while its texture stays.  By least squares over the square, with x the
place as it is known and y the frame, both with black at zero::

    g = sum(x y) / sum(x x),   left = mean |y - g x|^2,   texture = g^2 var(x)

Another surface does not have this texture: then more is left than it has.  So where the texture
is several times what is left, and not noise, the place is what is seen, however bright it is.
Where a place has no texture nothing is said.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

_SIDE = 7
"""Side of the square, in working pixels."""

_LEAST_KNOWN = 0.6
"""Least share of the square that must be known."""

_TEXTURE = 4.0
"""Least texture, over the variance of the noise and over what is left."""

_DARKEST, _BRIGHTEST = 0.2, 5.0
"""Least and most factor of light."""

_OFF = 1.5
"""Standard deviations that a pixel of the place may be off, in each channel."""

_BLACK = 16.0
"""Lightness of black in L*: below zero, so that a factor of light is one of L* as well."""

_GRAY = 128.0


def relight(
    sums: NDArray[np.float32], lab: NDArray[np.uint8], sigma: float
) -> NDArray[np.float32]:
    """
    Return a background in the light of a frame, where that shows it; elsewhere as it was.

    :param sums: (h, w, 4) float32, see :class:`.BackgroundModel`.
    :param lab: (h, w, 3) uint8, the frame.
    :param sigma: standard deviation of the noise.
    """
    # Four at a time are added up much faster than seven.
    place, both = np.empty((2, *lab.shape[:2], 4), np.float32)
    _products(sums, lab, place, both)
    _average(place)
    _average(both)
    light = np.empty((*lab.shape[:2], 2), np.float32)
    _find_light(place, both, sigma, light)
    _average(light)
    out = np.empty_like(sums)
    _change_light(sums, lab, light, sigma, out)
    return out


def _average(planes: NDArray[np.float32]) -> None:
    """Take the mean over the square about each pixel; outside all is zero."""
    square = (_SIDE, _SIDE)
    cv2.boxFilter(planes, cv2.CV_32F, square, dst=planes, borderType=cv2.BORDER_CONSTANT)


@kernel('f4[:,:,::1], u1[:,:,::1], f4[:,:,::1], f4[:,:,::1]', fastmath=True, error_model='numpy')
def _products(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    place: NDArray[np.float32],
    both: NDArray[np.float32],
) -> None:
    """Fill in the three x of a pixel and whether it is known; the sums of x x, x y and y y."""
    zero, one = np.float32(0), np.float32(1)
    black, gray = np.float32(_BLACK), np.float32(_GRAY)
    for row in range(lab.shape[0]):
        line, pixels = sums[row].reshape(-1), lab[row].reshape(-1)
        known_there, result = place[row].reshape(-1), both[row].reshape(-1)
        for col in range(lab.shape[1]):
            count = line[4 * col + 3]
            known = one if count >= one else zero
            share = known / max(count, one)
            x = line[4 * col] * share + known * black
            x_a = line[4 * col + 1] * share - known * gray
            x_b = line[4 * col + 2] * share - known * gray
            y = known * (np.float32(pixels[3 * col]) + black)
            y_a = known * (np.float32(pixels[3 * col + 1]) - gray)
            y_b = known * (np.float32(pixels[3 * col + 2]) - gray)
            known_there[4 * col] = x
            known_there[4 * col + 1] = x_a
            known_there[4 * col + 2] = x_b
            known_there[4 * col + 3] = known
            result[4 * col] = x * x + x_a * x_a + x_b * x_b
            result[4 * col + 1] = x * y + x_a * y_a + x_b * y_b
            result[4 * col + 2] = y * y + y_a * y_a + y_b * y_b
            result[4 * col + 3] = zero


@kernel('f4[:,:,::1], f4[:,:,::1], f8, f4[:,:,::1]', fastmath=True, error_model='numpy')
def _find_light(
    place: NDArray[np.float32],
    both: NDArray[np.float32],
    sigma: float,
    light: NDArray[np.float32],
) -> None:
    """Fill in whether the square about a pixel shows the place, and the factor of light if so."""
    zero, one, tiny = np.float32(0), np.float32(1), np.float32(1e-3)
    noise, times = np.float32(_TEXTURE * sigma * sigma), np.float32(_TEXTURE)
    for row in range(place.shape[0]):
        line, products, result = (
            place[row].reshape(-1),
            both[row].reshape(-1),
            light[row].reshape(-1),
        )
        for col in range(place.shape[1]):
            x, x_a, x_b = line[4 * col], line[4 * col + 1], line[4 * col + 2]
            part = max(line[4 * col + 3], tiny)
            square, product = products[4 * col], products[4 * col + 1]
            gain = product / max(square, tiny)
            left = max(products[4 * col + 2] - gain * product, zero)
            texture = gain * gain * (square - (x * x + x_a * x_a + x_b * x_b) / part)
            same = (part >= np.float32(_LEAST_KNOWN)) & (texture > times * left)
            same &= (texture > noise * part) & (gain > np.float32(_DARKEST))
            same &= gain < np.float32(_BRIGHTEST)
            result[2 * col] = one if same else zero
            result[2 * col + 1] = gain if same else zero


@kernel(
    'f4[:,:,::1], u1[:,:,::1], f4[:,:,::1], f8, f4[:,:,::1]', fastmath=True, error_model='numpy'
)
def _change_light(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    light: NDArray[np.float32],
    sigma: float,
    out: NDArray[np.float32],
) -> None:
    """Fill in the sums, by the light of the squares about a pixel if it is as that predicts."""
    zero, one, tiny = np.float32(0), np.float32(1), np.float32(1e-6)
    black, gray = np.float32(_BLACK), np.float32(_GRAY)
    most = np.float32(3 * (_OFF * sigma) ** 2)
    for row in range(lab.shape[0]):
        line, pixels, result = sums[row].reshape(-1), lab[row].reshape(-1), out[row].reshape(-1)
        shown = light[row].reshape(-1)
        for col in range(lab.shape[1]):
            count = line[4 * col + 3]
            share, gain = one / max(count, one), shown[2 * col + 1] / max(shown[2 * col], tiny)
            base = gain * (line[4 * col] * share + black) - black
            base_a = gain * (line[4 * col + 1] * share - gray) + gray
            base_b = gain * (line[4 * col + 2] * share - gray) + gray
            off = np.float32(pixels[3 * col]) - base
            off_a = np.float32(pixels[3 * col + 1]) - base_a
            off_b = np.float32(pixels[3 * col + 2]) - base_b
            same = (shown[2 * col] > zero) & (count >= one)
            same &= off * off + off_a * off_a + off_b * off_b < most
            result[4 * col] = base * count if same else line[4 * col]
            result[4 * col + 1] = base_a * count if same else line[4 * col + 1]
            result[4 * col + 2] = base_b * count if same else line[4 * col + 2]
            result[4 * col + 3] = count
