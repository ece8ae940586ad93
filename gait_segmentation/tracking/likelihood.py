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

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel, colour_bins
from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig

_SHADOW_FROM = 0.7
"""Where down the body cast shadows begin."""

_DOUBT = 0.1
"""
Times a pixel must have been seen for half of the trust: what was just uncovered tells at once.
How far the background is misplaced, in pixels, is added, since it may be another pixel then.
"""

_LIMIT = 6.0
"""Largest log-likelihood ratio that colours and background can give."""


_EXP = tuple(
    np.float32(c) for c in (1.3333558e-3, 9.618129e-3, 5.5504109e-2, 0.24022651, 0.69314718, 1.0)
)
_LOG = tuple(
    np.float32(c)
    for c in (
        *(7.0376836e-2, -0.11514610, 0.11676999, -0.12420141, 0.14249323),
        *(-0.16668058, 0.20000715, -0.24999994, 0.33333331),
    )
)
"""Polynomials that come within 2e-7 of powers of two, and of logarithms; highest powers first."""


@njit(nogil=True, fastmath=True, inline='always')
def _exp_minus(value: np.float32) -> np.float32:
    """Return exp(-value) from 0 on, which is never 0: a power of two and a polynomial."""
    power = min(value, np.float32(40)) * np.float32(-1.44269504)
    whole = np.float32(np.int32(power - np.float32(0.5)))
    x, (a, b, c, d, e, f) = power - whole, _EXP
    part = ((((a * x + b) * x + c) * x + d) * x + e) * x + f
    bits = np.int32((np.int32(whole) + np.int32(127)) << np.int32(23))
    return part * bits.view(np.float32)


@njit(nogil=True, fastmath=True, inline='always')
def _log(value: np.float32) -> np.float32:
    """Return the natural logarithm: the exponent and a polynomial of the mantissa."""
    bits = np.float32(value).view(np.int32)
    # The mantissa from half the square root of two to all of it.
    exponent = np.int32((bits - np.int32(0x3F3504F3)) >> np.int32(23))
    x = np.int32(bits - (exponent << np.int32(23))).view(np.float32) - np.float32(1)
    a, b, c, d, e, f, g, h, i = _LOG
    part = (((((((a * x + b) * x + c) * x + d) * x + e) * x + f) * x + g) * x + h) * x + i
    square = x * x
    first = x - np.float32(0.5) * square + square * x * part
    return first + np.float32(exponent) * np.float32(0.69314718)


@kernel('f4[:,:,::1], f8, f4[:,:,::1]', fastmath=True, error_model='numpy')
def widen(sums: NDArray[np.float32], share: float, wider: NDArray[np.float32]) -> None:
    """
    Add to variances what a misplaced background differs by.

    The slopes of what is at the edge of the window or next to what is unknown count as zero.

    :param sums: of the window, see :class:`.BackgroundModel`.
    :param share: of the squared slopes that is added.
    :param wider: (2, h, w) float32, of lightness and of chroma.
    """
    least, one, zero = np.float32(1e-6), np.float32(1), np.float32(0)
    for row in range(1, wider.shape[1] - 1):
        for col in range(1, wider.shape[2] - 1):
            up, low = sums[row - 1, col], sums[row + 1, col]
            near, far = sums[row, col - 1], sums[row, col + 1]
            fewest = min(min(up[3], low[3]), min(near[3], far[3]))
            gain = np.float32(0.25 * share) if fewest > zero else zero
            above, below = one / max(up[3], least), one / max(low[3], least)
            before, after = one / max(near[3], least), one / max(far[3], least)
            for channel in range(3):
                down = low[channel] * below - up[channel] * above
                across = far[channel] * after - near[channel] * before
                wider[min(channel, 1), row, col] += gain * (down * down + across * across)


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

    :param sums: of the window, see :class:`.BackgroundModel`.
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
    most, least, feet = np.float32(trust), np.float32(1e-6), np.float32(_SHADOW_FROM)
    bound = np.float32(_LIMIT)
    width = out.shape[1]
    of_person, of_surroundings = np.empty(width, np.float32), np.empty(width, np.float32)
    for row in range(out.shape[0]):
        for col in range(width):
            band = min(max(int(rows[row, col] * np.float32(BANDS)), 0), BANDS - 1)
            of_person[col] = person[bins[row, col], band]
            of_surroundings[col] = surroundings[bins[row, col], band]
        wide, wide_chroma = wider[0, row], wider[1, row]
        pixels = lab[row].reshape(-1)
        line = sums[row].reshape(-1)
        down, strange, result = rows[row], strangers[row], out[row]
        for col in range(width):
            count = line[4 * col + 3]
            share = one / max(count, least)
            base, light = line[4 * col] * share, np.float32(pixels[3 * col])
            d_light = light - base
            d_a = np.float32(pixels[3 * col + 1]) - line[4 * col + 1] * share
            d_b = np.float32(pixels[3 * col + 2]) - line[4 * col + 2] * share
            chroma = (d_a * d_a + d_b * d_b) * scale / wide_chroma[col]
            square = d_light * d_light * scale / wide[col]
            cast = cast_share if (base > one) & (down[col] > feet) else zero
            shadow = cast * flat if light > cast_floor * base else zero
            # Divided before they are chosen: else the compiler does one pixel at a time.
            shadow = shadow / max(base, one) if light < base else zero
            plain = (one - cast) * peak * _exp_minus(square)
            seen = (shadow + plain) * _exp_minus(chroma)
            # All times (count + doubt), which saves a division.
            known = most * count
            every = count + doubt
            unknown = (every - known) * of_surroundings[col] + every * strange[col]
            value = _log(every * of_person[col] / (known * seen + unknown))
            result[col] = min(max(value, -bound), bound)


def log_ratio(
    lab: NDArray[np.uint8],
    rows: NDArray[np.float32],
    window: Window,
    background: BackgroundModel,
    person: ColourModel,
    surroundings: ColourModel,
    config: TrackingConfig,
    strangers: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """
    Return ln p(person) / p(surroundings) in a window, (h, w) float32.

    :param lab: (h, w, 3) uint8, the window of the working image.
    :param rows: (h, w) position down the body.
    :param window: the window's rows and columns in the working image.
    :param strangers: (h, w) float32, probability of any colour of another person, if any.
    """
    out = np.empty(rows.shape, np.float32)
    sums = np.ascontiguousarray(background.sums[window])
    wider = np.ones((2, *rows.shape), np.float32)
    if background.misplacement:
        widen(sums, (background.misplacement / background.sigma) ** 2, wider)
    ratios(
        lab,
        colour_bins(lab),
        rows,
        sums,
        wider,
        background.misplacement,
        person.table,
        surroundings.table,
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
    image[window] = np.rint(255 / (1 + cv2.exp(-logit)))
    return image
