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

from gait_segmentation.kernels import kernel

__all__ = ['ChannelModel', 'class_histograms', 'moments_ratio']

_SHIFT = 3
_BINS = 256 >> _SHIFT
_DELTA = 1e-3
_LEAST_SPREAD = 0.05
"""Added to the variances within the classes, so that few pixels do not make a perfect feature."""

PERSON, SURROUNDINGS = 1, 0
"""Values of labels; any other is left out."""


@kernel('u1[:,::1], u1[:,::1], b1, f8[:,::1]')
def _count(
    channel: NDArray[np.uint8],
    labels: NDArray[np.uint8],
    has_neutral: bool,
    out: NDArray[np.float64],
) -> None:
    # What is left out is counted, too: that is faster than to ask.
    counts = np.zeros((3, _BINS), np.int32)
    for row in range(channel.shape[0]):
        values, classes = channel[row], labels[row]
        for col in range(values.size):
            counts[min(classes[col], np.uint8(2)), values[col] >> _SHIFT] += 1
    for label in range(2):
        total = max(counts[label].sum(), 1)
        for place in range(_BINS):
            out[label, place] = counts[label, place] / total
        if has_neutral:
            out[label, 0] = 0


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


@njit(nogil=True, inline='always')
def _variance_ratio(low: float, low_square: float, high: float, high_square: float) -> float:
    """Return the variance ratio from the means and mean squares of surroundings and person."""
    if high <= low:
        return 0.0
    between = (low_square + high_square) / 2 - ((low + high) / 2) ** 2
    within = (low_square - low * low) + (high_square - high * high) + _LEAST_SPREAD
    return between / within


@kernel('f4[:,::1], u1[:,::1], i8', fastmath=True)
def _ratio_of_pixels(logit: NDArray[np.float32], labels: NDArray[np.uint8], step: int) -> float:
    """Return the variance ratio of every ``step``-th pixel."""
    zero, width = np.float32(0), labels.shape[1]
    line = np.empty(width, np.float32)
    # Number, sum and sum of squares of each class.
    count_low, sum_low, square_low = 0, 0.0, 0.0
    count_high, sum_high, square_high = 0, 0.0, 0.0
    for row in range(labels.shape[0]):
        values, classes = logit[row * step], labels[row]
        for col in range(width):
            line[col] = values[col * step]
        n_low, s_low, q_low = np.int32(0), zero, zero
        n_high, s_high, q_high = np.int32(0), zero, zero
        for col in range(width):
            label, value = classes[col], line[col]
            low = value if label == SURROUNDINGS else zero
            high = value if label == PERSON else zero
            n_low += np.int32(label == SURROUNDINGS)
            n_high += np.int32(label == PERSON)
            s_low += low
            s_high += high
            q_low += low * low
            q_high += high * high
        count_low, sum_low, square_low = count_low + n_low, sum_low + s_low, square_low + q_low
        count_high, sum_high = count_high + n_high, sum_high + s_high
        square_high += q_high
    if min(count_low, count_high) < 1:
        return 0.0
    return _variance_ratio(
        sum_low / count_low,
        square_low / count_low,
        sum_high / count_high,
        square_high / count_high,
    )


def moments_ratio(logit: NDArray[np.float32], labels: NDArray[np.uint8], step: int = 1) -> float:
    """
    Return the variance ratio of log-likelihood ratios given pixel by pixel.

    It is 0 where they are no higher on the person.

    :param logit: (h, w) float32, of which every ``step``-th pixel is looked at.
    :param labels: uint8 of these pixels, as for :func:`class_histograms`.
    """
    return float(_ratio_of_pixels(logit, labels, step))


@kernel('f8[::1], f8[::1], f8[::1], f8[:,::1], f8, b1, f8, f4[::1]')
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


@kernel('f8[:,::1], f4[::1]')
def _ratio_of_histograms(newest: NDArray[np.float64], table: NDArray[np.float32]) -> float:
    """Return the variance ratio of what a table says of the pixels in histograms."""
    shares, means, squares = np.zeros(2), np.zeros(2), np.zeros(2)
    for label in range(2):
        for place in range(table.size):
            value, share = np.float64(table[place]), newest[label, place]
            shares[label] += share
            means[label] += share * value
            squares[label] += share * value * value
    if min(shares[0], shares[1]) <= 0:
        return 0.0
    return _variance_ratio(
        means[SURROUNDINGS], squares[SURROUNDINGS], means[PERSON], squares[PERSON]
    )


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
        return float(_ratio_of_histograms(newest, self.table))

    def log_ratio(self, channel: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the log-likelihood ratios of a channel, (h, w) float32."""
        # Ten times as fast as picking from the table by an array of indices.
        return np.asarray(cv2.LUT(channel, np.repeat(self.table, 1 << _SHIFT)))
