# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The log-likelihood ratio of person against surroundings, pixel by pixel.

One formula covers what is known of a background pixel and what is not::

    p_bg = a [(1 - s) N(c; B, sigma) + s S(c; B, sigma)] + (1 - a) p_bg,hist
    L    = ln(p_fg,hist / (p_bg + p_others))

with the background's mean B, trust a = a_max n / (n + 1/10 + m) in a pixel seen n times if the
background is misplaced by m pixels, and the density S of a cast shadow: any lightness from
``floor`` to 1 of the background's, same chroma (Horprasert, Harwood and Davis, ICCV Frame-Rate
Workshop 1999), near the feet.
Another person may have any colour, away from where the person is expected.
Where the background is steep, sigma grows by what a misplaced background would differ there.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel, colour_bins
from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig

_SHADOW_FROM, _SHADOW_TO = 0.60, 0.85
"""Where down the body cast shadows begin and are full."""

_DOUBT = 0.1
"""
Times a pixel must have been seen for half of the trust: what was just uncovered tells at once.
How far the background is misplaced, in pixels, is added, since it may be another pixel then.
"""

_LEAST_COUNT = 0.25
"""Background pixels seen less often than this, at the rim of what is known, are unknown."""

_MOST_RATIO = 6.0
"""Largest log-likelihood ratio that colours and background can give."""

_NO_DENSITY = 18.0
"""Exponents from which a density counts as nothing."""

_LEAST_MISPLACED = 0.05
"""Misplacement of the background from which it counts, in pixels."""

_CERTAIN = 8.0
"""Log ratio beyond which an image of 8 bits shows no difference."""


@njit(nogil=True, fastmath=True, inline='always')
def _exp_minus(value: np.float32) -> np.float32:
    """Return exp(-value) of 0..80, to 2e-7 of it: a power of two and a polynomial."""
    power = value * np.float32(-1.44269504)
    whole = np.float32(np.int32(power - np.float32(0.5)))
    rest = power - whole
    part = np.float32(1.3333558e-3)
    part = part * rest + np.float32(9.618129e-3)
    part = part * rest + np.float32(5.5504109e-2)
    part = part * rest + np.float32(0.24022651)
    part = part * rest + np.float32(0.69314718)
    part = part * rest + np.float32(1)
    bits = np.int32((np.int32(whole) + np.int32(127)) << np.int32(23))
    return part * bits.view(np.float32)


@njit(nogil=True, fastmath=True, inline='always')
def _log(value: np.float32) -> np.float32:
    """Return the natural logarithm, to 2e-7: the exponent and a polynomial of the mantissa."""
    bits = np.float32(value).view(np.int32)
    # The mantissa from half the square root of two to all of it.
    exponent = np.int32((bits - np.int32(0x3F3504F3)) >> np.int32(23))
    rest = np.int32(bits - (exponent << np.int32(23))).view(np.float32) - np.float32(1)
    part = np.float32(7.0376836e-2)
    part = part * rest - np.float32(0.11514610)
    part = part * rest + np.float32(0.11676999)
    part = part * rest - np.float32(0.12420141)
    part = part * rest + np.float32(0.14249323)
    part = part * rest - np.float32(0.16668058)
    part = part * rest + np.float32(0.20000715)
    part = part * rest - np.float32(0.24999994)
    part = part * rest + np.float32(0.33333331)
    square = rest * rest
    first = rest - np.float32(0.5) * square + square * rest * part
    return first + np.float32(exponent) * np.float32(0.69314718)


@kernel('f4[:,:,::1], f8, f4[:,:,::1]', error_model='numpy')
def widen(sums: NDArray[np.float32], share: float, wider: NDArray[np.float32]) -> None:
    """
    Add to variances what a misplaced background differs by.

    The slopes of what is at the edge of the window or next to what is unknown count as zero.

    :param sums: of the background.
    :param share: of the squared slopes that is added.
    :param wider: (2, h, w) float32, of lightness and of chroma.
    """
    height, width = wider.shape[1:]
    mean, counts = np.empty((3, height, width), np.float32), np.empty((height, width), np.float32)
    least = np.float32(_LEAST_COUNT)
    for row in range(height):
        line = sums[row].reshape(-1)
        for col in range(width):
            count = line[4 * col + 3]
            counts[row, col] = count
            for channel in range(3):
                mean[channel, row, col] = line[4 * col + channel] / max(count, least)
    for row in range(1, height - 1):
        above, below, here = counts[row - 1], counts[row + 1], counts[row]
        for col in range(1, width - 1):
            fewest = min(min(above[col], below[col]), min(here[col - 1], here[col + 1]))
            gain = np.float32(0.25 * share) if fewest >= least else np.float32(0)
            light, chroma = np.float32(0), np.float32(0)
            for channel in range(3):
                down = mean[channel, row + 1, col] - mean[channel, row - 1, col]
                across = mean[channel, row, col + 1] - mean[channel, row, col - 1]
                square = down * down + across * across
                if channel == 0:
                    light = square
                else:
                    chroma += square
            wider[0, row, col] += gain * light
            wider[1, row, col] += gain * chroma


@njit(nogil=True, fastmath=True, inline='always')
def _look_up(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    person: NDArray[np.float32],
    surroundings: NDArray[np.float32],
    of_person: NDArray[np.float32],
    of_surroundings: NDArray[np.float32],
) -> None:
    """Fill in how likely the colours of a row of pixels are for each class."""
    bands = np.float32(BANDS)
    for col in range(bins.size):
        band = min(max(int(rows[col] * bands), 0), BANDS - 1)
        of_person[col] = person[bins[col], band]
        of_surroundings[col] = surroundings[bins[col], band]


@kernel(
    'u1[:,:,::1], u2[:,::1], f4[:,::1], f4[:,:,::1], f4[:,:,::1], f8, f4[:,::1], '
    'f4[:,::1], f4[:,::1], f8, f8, f8, f8, f4[:,::1]',
    fastmath=True,
    error_model='numpy',
)
def ratios(
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    sums: NDArray[np.float32],
    wider: NDArray[np.float32],
    misplacement: float,
    person: NDArray[np.float32],
    surroundings: NDArray[np.float32],
    strangers: NDArray[np.float32],
    sigma: float,
    trust: float,
    shadow_share: float,
    shadow_floor: float,
    out: NDArray[np.float32],
) -> None:
    """
    Fill in the log-likelihood ratios of a window.

    Row by row and without branches, so that many pixels are done at once: first what is looked
    up, then all that is calculated.

    :param sums: of the background.
    :param wider: (2, h, w) float32, by what the variances of lightness and chroma are greater.
    :param misplacement: of the background, in pixels.
    :param strangers: (h, w) float32, probability of any colour of another person.
    """
    zero, one = np.float32(0), np.float32(1)
    doubt = np.float32(_DOUBT + misplacement)
    scale = np.float32(1 / (2 * sigma * sigma))
    peak = np.float32(BIN_VOLUME / (2 * np.pi * sigma * sigma) ** 1.5)
    flat = np.float32(BIN_VOLUME / (2 * np.pi * sigma * sigma) / (1 - shadow_floor))
    cast_share, cast_floor = np.float32(shadow_share), np.float32(shadow_floor)
    most, least = np.float32(trust), np.float32(_LEAST_COUNT)
    ramp_from, ramp_slope = np.float32(_SHADOW_FROM), np.float32(1 / (_SHADOW_TO - _SHADOW_FROM))
    bound = np.float32(_MOST_RATIO)
    far = np.float32(_NO_DENSITY)
    width = out.shape[1]
    of_person, of_surroundings = np.empty(width, np.float32), np.empty(width, np.float32)
    for row in range(out.shape[0]):
        _look_up(bins[row], rows[row], person, surroundings, of_person, of_surroundings)
        wide, wide_chroma = wider[0, row], wider[1, row]
        pixels, line = lab[row].reshape(-1), sums[row].reshape(-1)
        down, strange, result = rows[row], strangers[row], out[row]
        for col in range(width):
            count = line[4 * col + 3]
            share = one / max(count, least)
            base, light = line[4 * col] * share, np.float32(pixels[3 * col])
            d_light = light - base
            d_a = np.float32(pixels[3 * col + 1]) - line[4 * col + 1] * share
            d_b = np.float32(pixels[3 * col + 2]) - line[4 * col + 2] * share
            chroma = min((d_a * d_a + d_b * d_b) * scale / wide_chroma[col], far)
            square = min(d_light * d_light * scale / wide[col], far)
            ramp = min(max((down[col] - ramp_from) * ramp_slope, zero), one)
            cast = cast_share * ramp if base > one else zero
            shadow = cast * flat if light > cast_floor * base else zero
            # Divided before they are chosen: else the compiler does one pixel at a time.
            shadow = shadow / max(base, one) if light < base else zero
            plain = (one - cast) * peak * _exp_minus(square)
            plain = plain if square < far else zero
            seen = (shadow + plain) * _exp_minus(chroma) if chroma < far else zero
            # All times (count + doubt), which saves a division.
            known = most * count if count > least else zero
            every = count + doubt
            unknown = (every - known) * of_surroundings[col] + every * strange[col]
            value = _log(every * of_person[col] / (known * seen + unknown))
            result[col] = min(max(value, -bound), bound)


def place_shown(
    background: BackgroundModel, lab: NDArray[np.uint8], window: Window, config: TrackingConfig
) -> BackgroundModel:
    """
    Return what a window of a frame should show of the background alone, in the frame's light.

    :param lab: (h, w, 3) uint8, the window of the frame.
    """
    return background.within(window, lab if config.use_relight else None)


class Colours:
    """The colours of a person and of what surrounds them, by height on the body, from masks."""

    def __init__(self, config: TrackingConfig) -> None:
        """Begin without any."""
        self.person, self.surroundings = (
            ColourModel(config.band_share, config.colour_floor) for _ in range(2)
        )

    def learn(
        self,
        lab: NDArray[np.uint8],
        rows: NDArray[np.float32],
        weights: tuple[NDArray[Any], NDArray[Any]],
        rates: tuple[float, float],
    ) -> None:
        """
        Learn from a window of a frame.

        :param lab: (h, w, 3) uint8.
        :param rows: (h, w) position down the body.
        :param weights: of pixels, (h, w) of any type, as the person and as the surroundings.
        :param rates: shares of the frame in what is known of the person and of the surroundings.
        """
        bins = colour_bins(lab)
        self.person.accumulate(bins, rows, weights[0], rates[0])
        self.surroundings.accumulate(bins, rows, weights[1], rates[1])

    def fade(self, chroma: float) -> None:
        """Go on as if all had the same a* and b*."""
        self.person.fade(chroma)
        self.surroundings.fade(chroma)


def log_ratio(
    lab: NDArray[np.uint8],
    rows: NDArray[np.float32],
    background: BackgroundModel,
    colours: Colours,
    config: TrackingConfig,
    strangers: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """
    Return ln p(person) / p(surroundings) in a window, (h, w) float32.

    :param lab: (h, w, 3) uint8, the window of the working image.
    :param rows: (h, w) position down the body.
    :param background: of the window alone.
    :param strangers: (h, w) float32, probability of any colour of another person, if any.
    """
    out = np.empty(rows.shape, np.float32)
    misplacement = background.misplacement if background.misplacement > _LEAST_MISPLACED else 0.0
    sums = background.sums
    wider = np.ones((2, *rows.shape), np.float32)
    if misplacement:
        widen(sums, (misplacement / background.sigma) ** 2, wider)
    ratios(
        lab,
        colour_bins(lab),
        rows,
        sums,
        wider,
        misplacement,
        colours.person.table,
        colours.surroundings.table,
        np.zeros_like(rows) if strangers is None else strangers,
        background.sigma,
        config.background_trust if config.use_background else 0.0,
        config.shadow_share if config.use_shadow else 0.0,
        config.shadow_floor,
        out,
    )
    return out


def likelihood_image(
    logit: NDArray[np.float32], window: Window, shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """
    Return the foreground likelihood image: P(person) as 0..255, zero outside the window.

    :param logit: (h, w) float32 log-likelihood ratio in the window.
    :param window: the window's rows and columns.
    :param shape: (h, w) of the working image.
    """
    image = np.zeros(shape, np.uint8)
    odds = cv2.exp(np.clip(-logit, -_CERTAIN, _CERTAIN))
    image[window] = np.rint(255 / (1 + odds))
    return image
