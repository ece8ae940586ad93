# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What a person looks like, coarsely: to tell whether a person found again is the same.

Histograms of colour in three bands of the body, compared by the Bhattacharyya coefficient.  They
are far coarser than those of the likelihood, which must tell a person from the surroundings at one
moment, and change slowly.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

SAME_COLOURS = 0.65
"""Least similarity of the colours of the same person."""

_BINS = (8, 32, 32, 3)
"""Bins of L*, a* and b*, and bands of the body."""

USUAL_RATE = 0.02
"""Share by which what is usual of a person moves towards what a mask shows."""


def colour_signature(
    lab: NDArray[np.uint8], inside: NDArray[np.uint8], rows: NDArray[np.float32]
) -> NDArray[np.float32]:
    """
    Return the joint histogram of a person's colours and bands, float32 that sums to 1.

    :param lab: (h, w, 3) uint8.
    :param inside: (h, w) uint8, above 127 on the person.
    :param rows: (h, w) position down the body, see :func:`~gait_segmentation.colour.body_rows`.
    """
    bands = np.clip(_BINS[3] * rows, 0, _BINS[3] - 1).astype(np.uint8)
    ranges = [0, 256, 0, 256, 0, 256, 0, _BINS[3]]
    mask = (inside > 127).view(np.uint8)
    counts = cv2.calcHist([lab, bands], [0, 1, 2, 3], mask, _BINS, ranges)
    for axis in range(3):
        counts = _smoothed(counts, axis)
    return counts / np.float32(max(float(counts.sum()), 1e-6))


def _smoothed(counts: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """Share what is in each bin of an axis with its neighbours."""
    first = np.moveaxis(counts, axis, 0)
    flat = cv2.GaussianBlur(
        first.reshape(len(first), -1), (1, 3), 0, borderType=cv2.BORDER_REPLICATE
    )
    return np.moveaxis(flat.reshape(first.shape), 0, axis)


def similarity(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Return how alike two signatures are, 0..1; bands count by what is seen of them."""
    shares, known = (each.sum(axis=(0, 1, 2)) for each in (other, one))
    weights = np.minimum(shares, known)
    if weights.sum() <= 0:
        return 0.0
    alike = np.sqrt(other * one).sum(axis=(0, 1, 2))
    alike /= np.sqrt(np.maximum(shares * known, 1e-12))
    return float((weights * alike).sum() / weights.sum())


class Appearance:
    """The colours of a person over time."""

    def __init__(self, signature: NDArray[np.float32]) -> None:
        self._mean = self._last = signature

    def fade(self, chroma: float) -> None:
        """Go on as if all colours had the same a* and b*, and their own lightness."""
        near = np.zeros(_BINS[:3], np.float32)
        place = int(chroma * _BINS[1] / 256)
        near[:, place, place] = 1
        near = _smoothed(_smoothed(near, 1), 2)[..., None]
        self._mean, self._last = (
            each.sum(axis=(1, 2), keepdims=True) * near for each in (self._mean, self._last)
        )

    def add(self, signature: NDArray[np.float32]) -> None:
        """Take in those of a frame, see :func:`colour_signature`."""
        self._last = signature
        self._mean = self._mean + np.float32(USUAL_RATE) * (signature - self._mean)

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
        known = self.similarity(self._last) >= SAME_COLOURS
        return known and similarity(self._last, signature) >= SAME_COLOURS
