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
Somebody else may have any colour, away from where the person is expected.
Where the background is steep, sigma grows by what a misplaced background would differ there.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import ColourModel
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood.kernels import ratios, widen

__all__ = ['likelihood_image', 'log_ratio']

_LEAST_MISPLACED = 0.05
"""Misplacement of the background from which it counts, in pixels."""

_CERTAIN = 8.0
"""Log ratio beyond which an image of 8 bits shows no difference."""


def log_ratio(
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    window: tuple[slice, slice],
    background: BackgroundModel,
    person: ColourModel,
    surroundings: ColourModel,
    config: TrackingConfig,
    strangers: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """
    Return ln p(person) / p(surroundings) in a window, (h, w) float32.

    :param lab: (h, w, 3) uint8, the window of the working image.
    :param bins: (h, w) joint colour bins of the window.
    :param rows: (h, w) position down the body.
    :param window: the window's rows and columns in the working image.
    :param strangers: (h, w) float32, probability of any colour of somebody else; None: nobody is.
    """
    out = np.empty(bins.shape, np.float32)
    misplacement = background.misplacement if background.misplacement > _LEAST_MISPLACED else 0.0
    sums, top, left = background.part(window)
    wider = np.ones((2, *bins.shape), np.float32)
    if misplacement:
        widen(sums, top, left, (misplacement / background.sigma) ** 2, wider)
    ratios(
        lab,
        bins,
        rows,
        sums,
        top,
        left,
        wider,
        misplacement,
        person.table,
        surroundings.table,
        np.zeros_like(rows) if strangers is None else strangers,
        background.sigma,
        config.background_trust if config.use_background else 0.0,
        config.shadow_share if config.use_shadow else 0.0,
        config.shadow_floor,
        config.logit_limit,
        out,
    )
    return out


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
    odds = cv2.exp(np.clip(-logit, -_CERTAIN, _CERTAIN))
    image[window] = np.rint(255 / (1 + odds))
    return image
