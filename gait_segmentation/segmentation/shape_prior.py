# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape prior's part of the energy: log-odds inside and cost of cutting off the outline."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import signed_distance
from gait_segmentation.kernels import kernel
from gait_segmentation.segmentation.config import SegmentationConfig

__all__ = ['ShapeTerms', 'shape_terms']

_LIMIT = 3.0
"""Largest log-odds a shape gives."""

_LEG_LIMIT = 1.25
"""Largest log-odds it gives at the height of the legs: a leg may be a phase ahead."""

_HIP, _KNEE = 0.15, 0.3
"""Body heights below the middle of the body where that begins, and where it holds in full."""


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
    body: BodyFrame,
    config: SegmentationConfig,
    trust: float = 1.0,
) -> ShapeTerms:
    """
    Return the terms of a warped template.

    The unary term is that of PoseCut (Bray, Kohli, Torr, ECCV 2006) in log-odds, linear in the
    signed distance on either side of the outline and limited; the pairwise cost is Freedman and
    Zhang's, saturated.

    :param prior: (h, w) uint8, the template in the window, 255 inside.
    :param body: the body in the window's pixels.
    :param trust: share (0..1) of the weight of the unary term.
    """
    if config.prior == 'none' or not trust or not (prior > 127).any():
        return ShapeTerms(None, None)
    distance = signed_distance(prior > 127)
    psi, logit = np.empty_like(distance), np.empty_like(distance)
    height = body.height
    _terms(
        distance,
        (-math.sin(body.angle) / height, math.cos(body.angle) / height),
        (body.center_x - 0.5, body.center_y - 0.5),
        np.float32(config.distance_reach * height),
        np.float32(config.template_slope * height),
        np.float32(config.template_depth * height),
        np.float32(config.template_margin * height),
        np.float32(trust * config.template_weight),
        psi,
        logit,
    )
    return ShapeTerms(None if config.prior == 'distance' else logit, psi)


@kernel('f4[:,::1], UniTuple(f8, 2), UniTuple(f8, 2), f4, f4, f4, f4, f4, f4[:,::1], f4[:,::1]')
def _terms(
    distance: NDArray[np.float32],
    axis: tuple[float, float],
    center: tuple[float, float],
    reach: float,
    slope: float,
    depth: float,
    margin: float,
    weight: float,
    psi: NDArray[np.float32],
    logit: NDArray[np.float32],
) -> None:
    """
    Fill in both terms.

    :param axis: what of a step right and of one down goes along the body, in body heights.
    :param center: the middle of the body, in pixels.
    """
    one, limit = np.float32(1), np.float32(_LIMIT)
    eased = np.float32(_LIMIT - _LEG_LIMIT)
    for row in range(distance.shape[0]):
        for col in range(distance.shape[1]):
            away = distance[row, col]
            psi[row, col] = min(abs(away) / reach, one)
            away += margin
            down = axis[0] * (col - center[0]) + axis[1] * (row - center[1])
            legs = min(max(np.float32((down - _HIP) / (_KNEE - _HIP)), np.float32(0)), one)
            most = limit - legs * eased
            odds = min(max(away / (depth if away > 0 else slope), -most), most)
            logit[row, col] = weight * odds
