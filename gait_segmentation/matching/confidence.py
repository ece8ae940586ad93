# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the phase of the path can be trusted."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.transitions import UNIT

__all__ = ['confidence', 'phase_evidence']

_TEMPERATURE = 0.06
_TOLERANCE = 0.05
_OFFSET, _WEIGHT = 3.13, 2.85
"""Logistic fit on drawn walkers of all directions, sizes and cadences with up to 38 % noise."""


def phase_evidence(leading: NDArray[np.int16], sequence: int, phase: int) -> float:
    """
    Return the log odds that path scores give to phases near one against all others.

    :param leading: (V, P) int16, best score of each template.
    :param sequence: sequence of the path.
    :param phase: phase of the path; phases within 5 % of the stride of it, or of it plus half a
        stride, count as near.
    """
    phases = leading.shape[1]
    scores = leading.astype(np.float64) / UNIT
    weights = np.exp((scores - scores.max()) / _TEMPERATURE).sum(axis=0)
    half = phases / 2
    away = np.abs((np.arange(phases) - phase + half / 2) % half - half / 2)
    near = float(weights[away <= _TOLERANCE * phases].sum())
    rest = float(weights.sum()) - near
    return math.log((near + 1e-6) / (rest + 1e-6))


def confidence(evidence: float) -> float:
    """
    Return the probability that the phase is right to 5 % of a stride, apart from half strides.

    :param evidence: from :func:`phase_evidence`.
    """
    logit = _OFFSET + _WEIGHT * evidence
    return 1 / (1 + math.exp(-max(min(logit, 30.0), -30.0)))
