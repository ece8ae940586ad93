# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Colours of person and surroundings, learnt from a likelihood of whatever origin and from the cuts.

A likelihood from outside may be blurred, shifted and full of holes; but not everywhere and always
in the same way, so that the colours learnt from it tell more than it does itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel

__all__ = ['LearntColours']

_BINS = 24
_BANDS = 6
_DECAY = 0.9
_OWN_BAND = 0.6
_BESIDE = 0.5
_UNSEEN = 1e-4
_LIMIT = 4.0
_FROM_LIKELIHOOD = 0.3
_LARGEST_WEIGHT = 1e6


class LearntColours:
    """Histograms of person and surroundings by height on the body; they forget in ten frames."""

    def __init__(self) -> None:
        """Start without having seen anything."""
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self._counts = np.zeros((2, _BANDS, _BINS**3), np.float32)
        self._weight = 1.0
        self.ready = False

    def copy(self) -> LearntColours:
        """Return one that has learnt the same."""
        other = LearntColours()
        other._counts, other._weight = self._counts.copy(), self._weight
        other.ready = self.ready
        return other

    def learn(
        self,
        lab: NDArray[np.uint8],
        body: BodyFrame,
        likelihood: NDArray[np.uint8],
        labels: NDArray[np.bool_] | None = None,
    ) -> None:
        """
        Take in a frame.

        :param lab: (h, w, 3) uint8, the colours.
        :param body: the body in its pixels.
        :param likelihood: (h, w) uint8; what is about one half teaches little.
        :param labels: (h, w) bool, the cut, which teaches more; None: there is none yet.
        """
        # Old counts are not lessened; new ones weigh more.
        self._weight /= _DECAY
        if self._weight > _LARGEST_WEIGHT:
            self._counts /= np.float32(self._weight)
            self._weight = 1.0
        share = 1.0 if labels is None else _FROM_LIKELIHOOD
        cut = np.zeros(likelihood.shape, np.bool_) if labels is None else labels
        _learn(lab, _bands(lab, body), likelihood, cut, share, self._weight, self._counts)
        self.ready = True

    def odds(self, lab: NDArray[np.uint8], body: BodyFrame) -> NDArray[np.float32]:
        """
        Return the log-odds of each pixel's colour, (h, w) float32.

        :param lab: (h, w, 3) uint8, the colours.
        :param body: the body in its pixels.
        """
        out = np.zeros(lab.shape[:2], np.float32)
        totals = self._counts.sum(2, dtype=np.float64)
        if totals.sum(1).min() > 0:
            _odds(lab, _bands(lab, body), self._counts, totals, out)
        return out


def _bands(lab: NDArray[np.uint8], body: BodyFrame) -> NDArray[np.int64]:
    """Return the band of each row."""
    height = (np.arange(lab.shape[0]) - body.center_y) / body.height + 0.5
    return np.clip(height * _BANDS, 0, _BANDS - 1).astype(np.int64)


@kernel()
def _bin(colour: NDArray[np.uint8]) -> int:
    place = 0
    for channel in range(3):
        place = place * _BINS + ((int(colour[channel]) * _BINS) >> 8)
    return place


@kernel()
def _learn(
    lab: NDArray[np.uint8],
    bands: NDArray[np.int64],
    likelihood: NDArray[np.uint8],
    labels: NDArray[np.bool_],
    share: float,
    weight: float,
    counts: NDArray[np.float32],
) -> None:
    height, width = labels.shape
    for row in range(height):
        for col in range(width):
            sure = 2 * likelihood[row, col] / 255 - 1
            place = _bin(lab[row, col])
            counts[int(sure > 0), bands[row], place] += weight * share * sure * sure
            if share >= 1:
                continue
            if not labels[row, col]:
                # Pixels that touch the person are mixtures.
                top, left = max(row - 1, 0), max(col - 1, 0)
                if labels[top : row + 2, left : col + 2].any():
                    continue
            counts[int(labels[row, col]), bands[row], place] += weight * (1 - share)


@kernel()
def _odds(
    lab: NDArray[np.uint8],
    bands: NDArray[np.int64],
    counts: NDArray[np.float32],
    totals: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    height, width = out.shape
    for row in range(height):
        band = bands[row]
        for col in range(width):
            place = _bin(lab[row, col])
            ratio = 1.0
            for side in range(2):
                own = norm = whole = 0.0
                for other in range(_BANDS):
                    count = counts[side, other, place]
                    whole += count
                    if abs(other - band) <= 1 and totals[side, other] > 0:
                        part = 1.0 if other == band else _BESIDE
                        own += part * count / totals[side, other]
                        norm += part
                share = (1 - _OWN_BAND) * whole / totals[side].sum() + _UNSEEN
                if norm > 0:
                    share += _OWN_BAND * own / norm
                ratio = ratio * share if side == 1 else ratio / share
            out[row, col] = min(max(np.log(ratio), -_LIMIT), _LIMIT)
