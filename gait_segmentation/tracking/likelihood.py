# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The log-likelihood ratio of person against surroundings, pixel by pixel.

One formula covers what is known of a background pixel and what is not::

    p_bg = a [(1 - s) N(c; B, sigma) + s S(c; B, sigma)] + (1 - a) p_bg,hist
    L    = ln(p_fg,hist / p_bg)

with the background's mean B, trust a = a_max n / (n + 1/2) in a pixel seen n times, and the
density S of a cast shadow: any lightness from ``floor`` to 1 of the background's, same chroma.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel
from gait_segmentation.tracking.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig

__all__ = ['likelihood_image', 'log_ratio']

_SHADOW_FROM, _SHADOW_TO = 0.60, 0.85
"""Where down the body cast shadows begin and are full."""


@njit(cache=True, nogil=True, fastmath=True)
def _ratio(
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    state: NDArray[np.float32],
    person: NDArray[np.float32],
    surroundings: NDArray[np.float32],
    sigma: float,
    trust: float,
    shadow_share: float,
    shadow_floor: float,
    limit: float,
    limit_known: float,
    out: NDArray[np.float32],
) -> None:
    scale = 1 / (2 * sigma * sigma)
    peak = BIN_VOLUME / (2 * np.pi * sigma * sigma) ** 1.5
    flat = BIN_VOLUME / (2 * np.pi * sigma * sigma * (1 - shadow_floor))
    for row in range(lab.shape[0]):
        for col in range(lab.shape[1]):
            down = rows[row, col]
            band = min(max(int(down * BANDS), 0), BANDS - 1)
            index = bins[row, col]
            p_person = person[index, band]
            p_background = surroundings[index, band]
            count = state[row, col, 3]
            bound = limit
            if trust > 0 and count > 0:
                if count >= 1:
                    bound = limit_known
                d_light = lab[row, col, 0] - state[row, col, 0]
                d_a = lab[row, col, 1] - state[row, col, 1]
                d_b = lab[row, col, 2] - state[row, col, 2]
                chroma = (d_a * d_a + d_b * d_b) * scale
                seen = 0.0
                share = 0.0
                if chroma < 18:
                    e_chroma = np.exp(-chroma)
                    light = d_light * d_light * scale
                    if shadow_share > 0:
                        ramp = (down - _SHADOW_FROM) / (_SHADOW_TO - _SHADOW_FROM)
                        share = shadow_share * min(max(ramp, 0.0), 1.0)
                        base = state[row, col, 0]
                        if share > 0 and base > 1:
                            darkness = lab[row, col, 0] / base
                            if shadow_floor < darkness < 1:
                                seen = share * flat / base * e_chroma
                    if light < 18:
                        seen += (1 - share) * peak * np.exp(-light) * e_chroma
                known = trust * count / (count + 0.5)
                p_background = known * seen + (1 - known) * p_background
            value = np.log(p_person / p_background)
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
    _ratio(
        lab,
        bins,
        rows,
        background.state[window],
        person.table,
        surroundings.table,
        background.sigma,
        config.background_trust if config.use_background else 0.0,
        config.shadow_share if config.use_shadow else 0.0,
        config.shadow_floor,
        config.logit_limit,
        config.background_logit_limit,
        out,
    )
    return out


@njit(cache=True, nogil=True, fastmath=True)
def _sigmoid(logit: NDArray[np.float32], out: NDArray[np.uint8]) -> None:
    for row in range(logit.shape[0]):
        for col in range(logit.shape[1]):
            out[row, col] = np.uint8(255 / (1 + np.exp(-logit[row, col])) + 0.5)


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
    _sigmoid(logit, image[window])
    return image
