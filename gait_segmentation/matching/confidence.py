# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The phase that is believed in, and how far it can be trusted."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ['phase_near']

_TOLERANCE = 0.05
"""Strides to either side of a phase that is called right."""
_CLEARLY = 0.99999
"""Belief in the other half of the stride from which it is taken."""


def phase_near(belief: NDArray[np.float64], phase: float) -> tuple[float, float]:
    """
    Return the mean phase of a belief, apart from half strides, and the probability of it.

    :param belief: (P,) float64, probabilities of the phases 0, 1 / P, ...; halves of a stride are
        laid over one another.
    :param phase: strides; of the two halves the one nearer to this is taken, unless the belief is
        clearly in the other one.
    :returns: the phase in [0, 1), and the probability that it is right to 5 % of a stride, apart
        from half strides, in 0..1.
    """
    at, circle = _circle(len(belief))
    across, along = (belief @ circle).tolist()
    mean = math.atan2(along, across) / (4 * math.pi)
    mean += round(2 * (phase - mean)) / 2
    if belief[np.abs((at - mean + 0.5) % 1.0 - 0.5) > 0.25].sum() > _CLEARLY:
        mean += 0.5
    away = np.abs((at - mean + 0.25) % 0.5 - 0.25)
    # A bin that reaches over the tolerance counts by the share of it within.
    share = np.minimum(np.maximum((_TOLERANCE - away) * len(belief) + 0.5, 0.0), 1.0)
    mean %= 1.0
    # What is next to nothing below 0 comes out as 1.
    return (mean if mean < 1.0 else 0.0), float(belief @ share)


@lru_cache(maxsize=4)
def _circle(phases: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return phases in strides, (P,), and where on a circle of half a stride, (P, 2), float64."""
    at = np.arange(phases) / phases
    return at, np.column_stack([np.cos(4 * np.pi * at), np.sin(4 * np.pi * at)])
