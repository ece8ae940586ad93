# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What a person looks like, coarsely: to tell whether a person found again is the same.

Histograms of colour in three bands of the body (head, trunk, legs), compared by the
Bhattacharyya coefficient.  They are far coarser than those of the likelihood, which must tell a
person from the surroundings at one moment, and change slowly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

SAME_COLOURS = 0.65
"""Least similarity of the colours of the same person."""

SURELY_SAME = 0.85
"""Similarity of the colours from which they are surely those of the person, and of no one else."""

_TRUNK_FROM, _LEGS_FROM = 0.16, 0.52
"""Where down the body trunk and legs begin."""

_LIGHT, _CHROMA = 8, 12
"""Bins of lightness, and of a and b each."""

_CHROMA_STEP = 8.0
_CHROMA_FROM = 128 - _CHROMA_STEP * _CHROMA / 2
_MEAN_RATE = 0.02


@kernel('u1[:,:,::1], u1[:,::1], f4[:,::1], f4[:,:,:,::1]')
def _count(
    lab: NDArray[np.uint8],
    inside: NDArray[np.uint8],
    rows: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Share each pixel between the two nearest bins of each axis."""
    for row in range(lab.shape[0]):
        for col in range(lab.shape[1]):
            if inside[row, col] <= 127:
                continue
            down = rows[row, col]
            band = 0 if down < _TRUNK_FROM else (1 if down < _LEGS_FROM else 2)
            light = min(max(lab[row, col, 0] / 32.0 - 0.5, 0.0), _LIGHT - 1.001)
            a = min(max((lab[row, col, 1] - _CHROMA_FROM) / _CHROMA_STEP - 0.5, 0.0), 10.999)
            b = min(max((lab[row, col, 2] - _CHROMA_FROM) / _CHROMA_STEP - 0.5, 0.0), 10.999)
            for i in range(2):
                p = int(light) + i
                u = 1 - abs(light - p)
                for j in range(2):
                    q = int(a) + j
                    v = u * (1 - abs(a - q))
                    for k in range(2):
                        r = int(b) + k
                        out[band, p, q, r] += v * (1 - abs(b - r))


def colour_signature(
    lab: NDArray[np.uint8], inside: NDArray[np.uint8], rows: NDArray[np.float32]
) -> NDArray[np.float32]:
    """
    Return the histograms of a person, (3, bins) float32, of which each sums to its share.

    :param lab: (h, w, 3) uint8.
    :param inside: (h, w) uint8, above 127 on the person.
    :param rows: (h, w) position down the body, see :func:`~gait_segmentation.colour.body_rows`.
    """
    out = np.zeros((3, _LIGHT, _CHROMA, _CHROMA), np.float32)
    _count(np.ascontiguousarray(lab), np.ascontiguousarray(inside), rows, out)
    total = float(out.sum())
    return out.reshape(3, -1) / np.float32(max(total, 1e-6))


def similarity(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Return how alike two signatures are, 0..1; bands count by what is seen of them."""
    shares, known = other.sum(axis=1), one.sum(axis=1)
    weights = np.minimum(shares, known)
    if weights.sum() <= 0:
        return 0.0
    alike = np.sqrt(other * one).sum(axis=1)
    alike /= np.sqrt(np.maximum(shares * known, 1e-12))
    return float((weights * alike).sum() / weights.sum())


class Appearance:
    """The colours of a person over time; ``last`` are those of the last mask."""

    def __init__(self, signature: NDArray[np.float32]) -> None:
        self._mean = self.last = signature

    def fade(self, chroma: float) -> None:
        """Go on as if all colours had the same a* and b*, and their own lightness."""
        place = (chroma - _CHROMA_FROM) / _CHROMA_STEP - 0.5
        near = np.maximum(1 - np.abs(np.arange(_CHROMA, dtype=np.float32) - np.float32(place)), 0)
        bins = np.stack([self._mean, self.last]).reshape(2, 3, _LIGHT, _CHROMA, _CHROMA)
        faded = bins.sum(axis=(3, 4), keepdims=True) * np.outer(near, near)
        self._mean, self.last = faded.reshape(2, 3, -1)

    def add(self, signature: NDArray[np.float32]) -> None:
        """Take in those of a frame, see :func:`colour_signature`."""
        self.last = signature
        self._mean = self._mean + np.float32(_MEAN_RATE) * (signature - self._mean)

    def similarity(self, signature: NDArray[np.float32]) -> float:
        """Return how alike the usual colours are, 0..1."""
        return similarity(self._mean, signature)

    def is_like(self, signature: NDArray[np.float32]) -> bool:
        """
        Return whether colours are those of the person, as usual or as they were last.

        A person who has walked into other light since the track began looks more like the last
        masks than like the mean.  These count only as far as they are like the mean themselves:
        they may be of another person who was taken for the person.
        """
        if self.similarity(signature) >= SAME_COLOURS:
            return True
        known = self.similarity(self.last) >= SAME_COLOURS
        return known and similarity(self.last, signature) >= SAME_COLOURS
