# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Histograms of one channel for person and surroundings, and how well they tell the two apart.

The log-likelihood ratio and the variance ratio are those of Collins and Liu (ICCV 2003), the
update by the similarity to the first model that of Wang and Yagi (TIP 2008)::

    L(u)  = ln max(p(u), d) / max(q(u), d)
    VR    = var(L; (p + q) / 2) / (var(L; p) + var(L; q))
    model = (1 - S) first + S current,   S = sum over u of sqrt(first(u) current(u))
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['ChannelModel', 'class_histograms', 'moments_ratio']

_SHIFT = 3
_BINS = 256 >> _SHIFT
_DELTA = 1e-3
_LEAST_SPREAD = 0.05
"""Added to the variances within the classes, so that few pixels do not make a perfect feature."""

PERSON, SURROUNDINGS = 1, 0
"""Values of labels; any other is left out."""


@njit(cache=True, nogil=True)
def _count(
    channel: NDArray[np.uint8],
    labels: NDArray[np.uint8],
    has_neutral: bool,
    out: NDArray[np.float64],
) -> None:
    for row in range(channel.shape[0]):
        for col in range(channel.shape[1]):
            label = labels[row, col]
            if label <= 1:
                out[label, channel[row, col] >> _SHIFT] += 1
    for label in range(2):
        total = max(out[label].sum(), 1.0)
        if has_neutral:
            out[label, 0] = 0
        for place in range(out.shape[1]):
            out[label, place] /= total


def class_histograms(
    channel: NDArray[np.uint8], labels: NDArray[np.uint8], *, has_neutral: bool
) -> NDArray[np.float64]:
    """
    Return the histograms of surroundings and person, (2, 32) float64, each with sum one.

    Neutral pixels count in the sums but in no bin; without pixels of a class its row is zero.

    :param channel: (h, w) uint8.
    :param labels: (h, w) uint8, 1 person, 0 surroundings, else left out.
    """
    out = np.zeros((2, _BINS))
    _count(channel, labels, has_neutral, out)
    return out


@njit(cache=True, nogil=True, fastmath=True)
def _sums(logit: NDArray[np.float32], labels: NDArray[np.uint8], out: NDArray[np.float64]) -> None:
    for row in range(logit.shape[0]):
        for col in range(logit.shape[1]):
            label = labels[row, col]
            if label <= 1:
                value = logit[row, col]
                out[label, 0] += 1
                out[label, 1] += value
                out[label, 2] += value * value


def moments_ratio(logit: NDArray[np.float32], labels: NDArray[np.uint8]) -> float:
    """
    Return the variance ratio of log-likelihood ratios given pixel by pixel.

    It is 0 where they are no higher on the person.
    """
    sums = np.zeros((2, 3))
    _sums(logit, labels, sums)
    if sums[:, 0].min() < 1:
        return 0.0
    return _variance_ratio(sums[:, 1] / sums[:, 0], sums[:, 2] / sums[:, 0])


def _variance_ratio(mean: NDArray[np.float64], square: NDArray[np.float64]) -> float:
    """Return the variance ratio from the means and mean squares of surroundings and person."""
    # In plain numbers, because this is done for all features in many frames.
    low, high = mean.tolist()
    low_square, high_square = square.tolist()
    if high <= low:
        return 0.0
    between = (low_square + high_square) / 2 - ((low + high) / 2) ** 2
    within = (low_square - low * low) + (high_square - high * high) + _LEAST_SPREAD
    return float(between / within)


@njit(cache=True, nogil=True)
def _follow(
    first: NDArray[np.float64],
    current: NDArray[np.float64],
    surroundings: NDArray[np.float64],
    newest: NDArray[np.float64],
    rate: float,
    has_neutral: bool,
    similarity: float,
    table: NDArray[np.float32],
) -> float:
    """Move the histograms of a channel and fill in its ratios; return the new similarity."""
    if min(newest[PERSON].sum(), newest[SURROUNDINGS].sum()) <= 0:
        return similarity
    alike = 0.0
    for place in range(table.size):
        current[place] += rate * (newest[PERSON, place] - current[place])
        surroundings[place] += rate * (newest[SURROUNDINGS, place] - surroundings[place])
        alike += np.sqrt(first[place] * current[place])
    alike = min(alike, 1.0)
    for place in range(table.size):
        person = first[place] + alike * (current[place] - first[place])
        table[place] = np.log(max(person, _DELTA) / max(surroundings[place], _DELTA))
    if has_neutral:
        table[0] = 0
    return alike


@njit(cache=True, nogil=True)
def _moments(
    newest: NDArray[np.float64], table: NDArray[np.float32], out: NDArray[np.float64]
) -> None:
    """Fill in the share of each class, and the mean and mean square of its ratios."""
    for label in range(2):
        for place in range(table.size):
            value, share = np.float64(table[place]), newest[label, place]
            out[0, label] += share
            out[1, label] += share * value
            out[2, label] += share * value * value


class ChannelModel:
    """What a channel looks like on the person and in the surroundings."""

    def __init__(self, *, has_neutral: bool) -> None:
        """Make a model that knows nothing: all its ratios are zero."""
        self._has_neutral = has_neutral
        self._first: NDArray[np.float64] | None = None
        self._current = np.zeros(_BINS)
        self._surroundings = np.zeros(_BINS)
        self.table = np.zeros(_BINS, np.float32)
        self.similarity = 1.0

    def learn(self, newest: NDArray[np.float64], rate: float) -> None:
        """
        Move towards the histograms of a frame, the person's less the less it is as at first.

        :param newest: see :func:`class_histograms`.
        :param rate: share of the newest frame.
        """
        if self._first is None:
            if newest.sum(axis=1).min() <= 0:
                return
            self._first = newest[PERSON].copy()
            self._current, self._surroundings = newest[PERSON].copy(), newest[SURROUNDINGS].copy()
        self.similarity = _follow(
            self._first,
            self._current,
            self._surroundings,
            newest,
            rate,
            self._has_neutral,
            self.similarity,
            self.table,
        )

    def variance_ratio(self, newest: NDArray[np.float64]) -> float:
        """Return how well the model tells the classes apart in a frame's histograms."""
        moments = np.zeros((3, 2))
        _moments(newest, self.table, moments)
        if moments[0].min() <= 0:
            return 0.0
        return _variance_ratio(moments[1], moments[2])

    def log_ratio(self, channel: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the log-likelihood ratios of a channel, (h, w) float32."""
        # Ten times as fast as picking from the table by an array of indices.
        return np.asarray(cv2.LUT(channel, np.repeat(self.table, 1 << _SHIFT)))
