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

    logit: NDArray[np.float32] | None = None
    psi: NDArray[np.float32] | None = None

    @property
    def some(self) -> bool:
        """Return whether the template says anything."""
        return self.logit is not None or self.psi is not None


def shape_terms(
    prior: NDArray[np.uint8],
    height: float,
    config: SegmentationConfig,
    trust: float = 1.0,
) -> ShapeTerms:
    """
    Return the unary term of a warped template.

    It is that of PoseCut (Bray, Kohli, Torr, ECCV 2006) in log-odds, linear in the signed distance
    on either side of the outline and limited.

    :param prior: (h, w) uint8, the template in the window, 255 inside.
    :param height: height of the body in pixels.
    :param trust: share (0..1) of the weight of the unary term.
    """
    if config.prior == 'none' or not trust or not (prior > 127).any():
        return ShapeTerms()
    # As steep inside: limbs are thin, so that what hides a leg or where it is a phase ahead is
    # for the likelihood to say.
    steps = signed_distance(prior > 127) / np.float32(config.template_slope * height)
    odds = np.clip(steps, -_LIMIT, _LIMIT)
    return ShapeTerms(np.float32(trust * config.template_weight) * odds)
