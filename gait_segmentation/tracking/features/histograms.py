# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Histograms of one feature for person and surroundings, and how well they tell the two apart.

The log-likelihood ratio and the variance ratio are those of Collins and Liu (ICCV 2003), the
update by the similarity to the first model that of Wang and Yagi (TIP 2008)::

    L(u)  = ln max(p(u), d) / max(q(u), d)
    VR    = var(L; (p + q) / 2) / (var(L; p) + var(L; q))
    model = (1 - S) first + S current,   S = sum over u of sqrt(first(u) current(u))
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ['FeatureModel', 'class_histograms']

_DELTA = 1e-3
_LEAST_SPREAD = 0.05
"""Added to the variances within the classes, so that few pixels do not make a perfect feature."""

PERSON, SURROUNDINGS = 1, 0
"""Values of labels; any other is left out."""


def class_histograms(
    places: NDArray[np.uint16], labels: NDArray[np.uint8], bins: int, *, has_neutral: bool
) -> NDArray[np.float64]:
    """
    Return the histograms of surroundings and person, (2, bins) float64, each with sum one.

    Neutral pixels count in the sums but in no bin; without pixels of a class its row is zero.

    :param places: (h, w) uint16, the bin of each pixel.
    :param labels: (h, w) uint8, 1 person, 0 surroundings, 2 left out.
    """
    joint = (labels.astype(np.intp) * bins + places).ravel()
    counts = np.bincount(joint, minlength=3 * bins)[: 2 * bins].reshape(2, bins)
    out = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    if has_neutral:
        out[:, 0] = 0
    return out


def _variance_ratio(low: float, low_spread: float, high: float, high_spread: float) -> float:
    """Return the variance ratio from means and variances of surroundings and person."""
    if high <= low:
        return 0.0
    within = low_spread + high_spread
    return (within / 2 + (high - low) ** 2 / 4) / (within + _LEAST_SPREAD)


class FeatureModel:
    """What a feature looks like on the person and in the surroundings."""

    def __init__(self, bins: int, *, has_neutral: bool) -> None:
        """Make a model that knows nothing: all its ratios are zero."""
        self._has_neutral = has_neutral
        self._first: NDArray[np.float64] | None = None
        self.table = np.zeros(bins, np.float32)

    def similarity(self, newest: NDArray[np.float64]) -> float:
        """Return how alike (0..1) the person is in a frame's histograms and was at first."""
        if self._first is None:
            return 1.0
        return min(float(np.sqrt(self._first * newest[PERSON]).sum()), 1.0)

    def learn(self, newest: NDArray[np.float64]) -> None:
        """
        Take over the histograms of a frame, the person's the less the less it is as at first.

        :param newest: see :func:`class_histograms`.
        """
        if newest.sum(axis=1).min() <= 0:
            return
        current = newest[PERSON]
        if self._first is None:
            self._first = current
        person = self._first + self.similarity(newest) * (current - self._first)
        surroundings = np.maximum(newest[SURROUNDINGS], _DELTA)
        self.table = np.log(np.maximum(person, _DELTA) / surroundings).astype(np.float32)
        if self._has_neutral:
            self.table[0] = 0

    def variance_ratio(self, newest: NDArray[np.float64]) -> float:
        """Return how well the model tells the classes apart in a frame's histograms."""
        if newest.sum(axis=1).min() <= 0:
            return 0.0
        means = newest @ self.table
        spreads = newest @ self.table**2 - means**2
        return float(
            _variance_ratio(
                means[SURROUNDINGS], spreads[SURROUNDINGS], means[PERSON], spreads[PERSON]
            )
        )

    def log_ratio(self, places: NDArray[np.uint16]) -> NDArray[np.float32]:
        """Return the log-likelihood ratios of the bins of pixels, (h, w) float32."""
        return self.table[places]
