# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape prior's part of the energy: log-odds inside and cost of cutting off the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import signed_distance
from gait_segmentation.segmentation.config import SegmentationConfig

__all__ = ['ShapeTerms', 'shape_terms']

_LIMIT = 3.0
"""Largest log-odds a shape gives."""


@dataclass(frozen=True)
class ShapeTerms:
    """
    What a template adds to the energy, in a window.

    ``logit`` is the (h, w) float32 unary term, ``psi`` the (h, w) float32 cost of a cut at each
    pixel in 0..1, either None if the prior does not use it.
    """

    logit: NDArray[np.float32] | None
    psi: NDArray[np.float32] | None


def shape_terms(
    prior: NDArray[np.uint8],
    height: float,
    config: SegmentationConfig,
    trust: float = 1.0,
) -> ShapeTerms:
    """
    Return the terms of a warped template.

    The unary term is that of PoseCut (Bray, Kohli, Torr, ECCV 2006) in log-odds, linear in the
    signed distance on either side of the outline and limited; the pairwise cost is Freedman and
    Zhang's, saturated.

    :param prior: (h, w) uint8, the template in the window, 255 inside.
    :param height: height of the body in pixels.
    :param trust: share (0..1) of the weight of the unary term.
    """
    if config.prior == 'none' or not trust or not (prior > 127).any():
        return ShapeTerms(None, None)
    distance = signed_distance(prior > 127)
    psi = np.minimum(np.abs(distance) / np.float32(config.distance_reach * height), np.float32(1))
    if config.prior == 'distance':
        return ShapeTerms(None, psi)
    # As steep inside: limbs are thin, so that what hides a leg or where it is a phase ahead is
    # for the likelihood to say.
    odds = np.clip(distance / np.float32(config.template_slope * height), -_LIMIT, _LIMIT)
    return ShapeTerms(np.float32(trust * config.template_weight) * odds, psi)
