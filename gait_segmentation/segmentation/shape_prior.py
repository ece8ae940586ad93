# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape prior's part of the energy: log-odds inside and cost of cutting off the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import signed_distance
from gait_segmentation.segmentation.config import SegmentationConfig

__all__ = ['ShapeTerms', 'log_odds', 'shape_terms']

_LOW, _HIGH = -4.0, 3.0
"""Limits of the log-odds a shape gives: a little surer outside than inside."""


@dataclass(frozen=True)
class ShapeTerms:
    """
    What a template adds to the energy, in a window.

    ``logit`` is the (h, w) float32 unary term, ``psi`` the (h, w) float32 cost of a cut at each
    pixel in 0..1, either None if the prior does not use it.
    """

    logit: NDArray[np.float32] | None
    psi: NDArray[np.float32] | None


def log_odds(probability: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return ln(p / (1 - p)) limited to what a shape may say."""
    p = np.clip(probability, 1e-3, 1 - 1e-3)
    return np.clip(np.log(p / (1 - p)), _LOW, _HIGH).astype(np.float32)


def shape_terms(
    prior: NDArray[np.uint8],
    height: float,
    personal: NDArray[np.float32] | None,
    config: SegmentationConfig,
) -> ShapeTerms:
    """
    Return the terms of a warped template.

    The unary term is that of PoseCut (Bray, Kohli, Torr, ECCV 2006) in log-odds, linear in the
    signed distance and limited; the pairwise cost is Freedman and Zhang's, saturated.

    :param prior: (h, w) uint8, the template in the window, 255 inside.
    :param height: height of the body in pixels.
    :param personal: (h, w) float32 in 0..1, the person's own mean shape, None if unknown.
    """
    if config.prior == 'none' or not (prior > 127).any():
        return ShapeTerms(None, None)
    distance = signed_distance(prior > 127)
    psi = np.minimum(np.abs(distance) / np.float32(config.distance_reach * height), 1)
    if config.prior == 'distance':
        return ShapeTerms(None, psi)
    logit = np.clip(distance / np.float32(config.template_slope * height), _LOW, _HIGH)
    if personal is not None:
        share = np.float32(config.residual_share)
        logit = (1 - share) * logit + share * log_odds(personal)
    return ShapeTerms(np.float32(config.template_weight) * logit, psi)
