# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The log-likelihood ratio of person against surroundings, pixel by pixel.

One formula covers what is known of a background pixel and what is not::

    p_bg = a [(1 - s) N(c; B, sigma) + s S(c; B, sigma)] + (1 - a) p_bg,hist
    L    = ln(p_fg,hist / p_bg)

with the background's mean B, trust a = a_max n / (n + 1/2) in a pixel seen n times, and the
density S of a cast shadow: any lightness from ``floor`` to 1 of the background's, same chroma.
Near the feet shadows are likely and may be dark; higher up, on a wall, they are soft and rare.
Where the background is steep, sigma grows by what a misplaced background would differ there.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel
from gait_segmentation.tracking.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig

__all__ = ['colour_log_ratio', 'likelihood_image', 'log_ratio']

_SHADOW_FROM, _SHADOW_TO = 0.60, 0.85
"""Where down the body cast shadows begin and are full."""

_LEAST_MISPLACED = 0.05
"""Misplacement of the background from which it counts, in pixels."""

_LEAST_COUNT = 0.25
"""Background pixels seen less often than this, at the rim of what is known, are unknown."""

_FARTHEST = 18.0
"""Exponents from which a density counts as nothing."""

_EXP_STEPS = 128
_EXP = np.exp(-np.arange(int(2 * _FARTHEST) * _EXP_STEPS + 2) / _EXP_STEPS).astype(np.float32)
"""exp(-t) of t in steps, to 0.4 %."""

_LOG_BITS = 12
_LOG = np.log1p(np.arange(1 << _LOG_BITS) / (1 << _LOG_BITS)).astype(np.float32)
"""Logarithm of a mantissa in 1..2, to 0.0003."""


@njit(nogil=True, inline='always')
def _fast_log(value: np.float32, table: NDArray[np.float32]) -> np.float32:
    bits = np.float32(value).view(np.int32)
    exponent = np.float32((bits >> 23) - 127)
    return exponent * np.float32(0.6931472) + table[(bits & 0x7FFFFF) >> (23 - _LOG_BITS)]


@njit(cache=True, nogil=True, fastmath=True)
def _ratio(
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    sums: NDArray[np.float32],
    slopes: NDArray[np.float32],
    misplacement: float,
    person: NDArray[np.float32],
    surroundings: NDArray[np.float32],
    exponentials: NDArray[np.float32],
    logarithms: NDArray[np.float32],
    sigma: float,
    trust: float,
    shadow_share: float,
    shadow_floor: float,
    shade_share: float,
    shade_floor: float,
    limit: float,
    limit_known: float,
    out: NDArray[np.float32],
) -> None:
    zero, one = np.float32(0), np.float32(1)
    scale = np.float32(1 / (2 * sigma * sigma))
    steps = np.float32(_EXP_STEPS)
    peak = np.float32(BIN_VOLUME / (2 * np.pi * sigma * sigma) ** 1.5)
    flat = np.float32(BIN_VOLUME / (2 * np.pi * sigma * sigma * (1 - shadow_floor)))
    flat_shade = np.float32(BIN_VOLUME / (2 * np.pi * sigma * sigma * (1 - shade_floor)))
    most = np.float32(trust)
    slope = np.float32(1 / (_SHADOW_TO - _SHADOW_FROM))
    low, high = np.float32(limit), np.float32(limit_known)
    far, half = np.float32(_FARTHEST), np.float32(0.5)
    misplaced = np.float32(misplacement * misplacement / (sigma * sigma))
    bands, least = np.float32(BANDS), np.float32(_LEAST_COUNT)
    for row in range(lab.shape[0]):
        for col in range(lab.shape[1]):
            down = rows[row, col]
            band = min(max(int(down * bands), 0), BANDS - 1)
            index = bins[row, col]
            p_person = person[index, band]
            p_background = surroundings[index, band]
            count = sums[row, col, 3]
            bound = low
            if most > zero and count > least:
                if count >= one:
                    bound = high
                share_of_one = one / count
                base = sums[row, col, 0] * share_of_one
                light = np.float32(lab[row, col, 0])
                d_light = light - base
                d_a = np.float32(lab[row, col, 1]) - sums[row, col, 1] * share_of_one
                d_b = np.float32(lab[row, col, 2]) - sums[row, col, 2] * share_of_one
                chroma = (d_a * d_a + d_b * d_b) * scale
                square = d_light * d_light * scale
                if misplaced > zero:
                    wider = one + misplaced * slopes[0, row, col]
                    wider_chroma = one + misplaced * slopes[1, row, col]
                    narrow = one / (wider * wider_chroma)
                    square *= wider_chroma * narrow
                    chroma *= wider * narrow
                seen = zero
                if chroma < far:
                    share = zero
                    if (shadow_share > 0 or shade_share > 0) and base > one:
                        ramp = min(max((down - np.float32(_SHADOW_FROM)) * slope, zero), one)
                        cast = np.float32(shadow_share) * ramp
                        shade = np.float32(shade_share) * (one - ramp)
                        share = cast + shade
                        if light < base:
                            density = zero
                            if light > shadow_floor * base:
                                density += cast * flat
                            if light > shade_floor * base:
                                density += shade * flat_shade
                            seen = density / base * exponentials[int(chroma * steps + half)]
                    if square < far:
                        seen += (
                            (one - share)
                            * peak
                            * exponentials[int((square + chroma) * steps + half)]
                        )
                # Both times (count + 1/2), which saves a division.
                known = most * count
                p_background = known * seen + (count + half - known) * p_background
                p_person *= count + half
            value = _fast_log(p_person / p_background, logarithms)
            out[row, col] = min(max(value, -bound), bound)


def log_ratio(
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    window: tuple[slice, slice],
    background: BackgroundModel,
    person: ColourModel,
    surroundings: ColourModel,
    config: TrackingConfig,
) -> NDArray[np.float32]:
    """
    Return ln p(person) / p(surroundings) in a window, (h, w) float32.

    :param lab: (h, w, 3) uint8, the window of the working image.
    :param bins: (h, w) joint colour bins of the window.
    :param rows: (h, w) position down the body.
    :param window: the window's rows and columns in the working image.
    """
    out = np.empty(bins.shape, np.float32)
    misplacement = background.misplacement if background.misplacement > _LEAST_MISPLACED else 0.0
    slopes = background.slopes(window) if misplacement else np.empty((2, 0, 0), np.float32)
    _ratio(
        lab,
        bins,
        rows,
        background.sums[window],
        slopes,
        misplacement,
        person.table,
        surroundings.table,
        _EXP,
        _LOG,
        background.sigma,
        config.background_trust if config.use_background else 0.0,
        config.shadow_share if config.use_shadow else 0.0,
        config.shadow_floor,
        config.shade_share if config.use_shadow else 0.0,
        config.shade_floor,
        config.logit_limit,
        config.background_logit_limit,
        out,
    )
    return out


@njit(cache=True, nogil=True, fastmath=True)
def _colour_ratio(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    person: NDArray[np.float32],
    surroundings: NDArray[np.float32],
    logarithms: NDArray[np.float32],
    limit: float,
    out: NDArray[np.float32],
) -> None:
    bound, bands = np.float32(limit), np.float32(BANDS)
    for row in range(bins.shape[0]):
        for col in range(bins.shape[1]):
            band = min(max(int(rows[row, col] * bands), 0), BANDS - 1)
            index = bins[row, col]
            value = _fast_log(person[index, band] / surroundings[index, band], logarithms)
            out[row, col] = min(max(value, -bound), bound)


def colour_log_ratio(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    person: ColourModel,
    surroundings: ColourModel,
    limit: float,
) -> NDArray[np.float32]:
    """
    Return what the colours alone say, (h, w) float32 within +-limit.

    :param bins: (h, w) joint colour bins.
    :param rows: (h, w) position down the body.
    """
    out = np.empty(bins.shape, np.float32)
    _colour_ratio(bins, rows, person.table, surroundings.table, _LOG, limit, out)
    return out


_SIGMOID_LIMIT, _SIGMOID_STEPS = 8.0, 64
_SIGMOID = np.rint(255 / (1 + np.exp(-np.linspace(-8, 8, 2 * 8 * _SIGMOID_STEPS + 1)))).astype(
    np.uint8
)
"""255 times the logistic function, by steps."""


@njit(cache=True, nogil=True, fastmath=True)
def _sigmoid(logit: NDArray[np.float32], table: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    limit, steps = np.float32(_SIGMOID_LIMIT), np.float32(_SIGMOID_STEPS)
    half = np.float32(0.5)
    for row in range(logit.shape[0]):
        for col in range(logit.shape[1]):
            value = min(max(logit[row, col], -limit), limit)
            out[row, col] = table[int((value + limit) * steps + half)]


def likelihood_image(
    logit: NDArray[np.float32], window: tuple[slice, slice], shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """
    Return the foreground likelihood image: P(person) as 0..255, zero outside the window.

    :param logit: (h, w) float32 log-likelihood ratio in the window.
    :param window: the window's rows and columns.
    :param shape: (h, w) of the working image.
    """
    image = np.zeros(shape, np.uint8)
    _sigmoid(logit, _SIGMOID, image[window])
    return image
