# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Colours of person and surroundings, of which each pixel hears what the others say.

Histograms learnt from uncertain labels repeat to a pixel what it and its neighbours put in, and
so confirm every error.  Here most of what was learnt near a pixel is taken off again before it is
judged (the leave-one-out estimate of a density): a colour that occurs only there says little, and
shape and edges decide.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, ColourModel
from gait_segmentation.kernels import kernel

__all__ = ['SoftColours']

_LIMIT = 4.0


class SoftColours:
    """Colours of two classes, learnt from a soft mask, in one window."""

    def __init__(
        self,
        bins: NDArray[np.uint16],
        rows: NDArray[np.float32],
        inside: NDArray[np.bool_],
        *,
        floor: float,
        radius: int,
        left_out: float,
    ) -> None:
        """
        Make models that know nothing.

        :param bins: (h, w) joint colour bins.
        :param rows: (h, w) position down the body.
        :param inside: (h, w) bool, where labels are uncertain; elsewhere all is surroundings, and
            what is learnt there is never taken off.
        :param floor: probability of a colour never seen.
        :param radius: distance in pixels, along rows and columns, of what counts as near.
        :param left_out: share of what was learnt nearby that is taken off.
        """
        self._bins, self._rows = bins, rows
        self._floor, self._left_out = floor, left_out
        self._near = _alike_nearby(bins, inside, radius)
        self._person = ColourModel(1.0, floor)
        self._surroundings = ColourModel(1.0, floor)
        self._soft = np.zeros(bins.shape, np.float32)
        self._rest = self._soft

    def with_rows(self, rows: NDArray[np.float32]) -> SoftColours:
        """Return models of the same window that know nothing, with another (h, w) position."""
        other = copy(self)
        other._rows = rows
        other._person, other._surroundings = (ColourModel(1.0, self._floor) for _ in range(2))
        return other

    def learn(
        self, person: NDArray[np.float32], rest: NDArray[np.float32], band_share: float
    ) -> None:
        """
        Learn anew from soft masks, all else is forgotten.

        :param person: (h, w) float32 in 0..1; ``rest`` likewise of the surroundings.
        :param band_share: weight of the colours of the own height band.
        """
        self._soft, self._rest = np.ascontiguousarray(person), np.ascontiguousarray(rest)
        for model, weight in ((self._person, person), (self._surroundings, rest)):
            model.band_share = band_share
            model.learn(self._bins, self._rows, weight, 1.0)

    def logit(self) -> NDArray[np.float32]:
        """Return ln p(person) / p(surroundings) of all pixels, (h, w) float32, limited to +-4."""
        out = np.empty(self._bins.shape, np.float32)
        _log_ratio(
            self._bins,
            self._rows,
            *self._near,
            self._soft,
            self._rest,
            self._person.table,
            self._surroundings.table,
            self._gain(self._soft, self._person.band_share),
            self._gain(self._rest, self._surroundings.band_share),
            self._floor,
            out,
        )
        return out

    def overlap(self) -> float:
        """Return Bhattacharyya's coefficient of the two histograms: 0 apart, 1 the same."""
        return float(np.sqrt(self._person.whole() * self._surroundings.whole()).sum())

    def _gain(self, weight: NDArray[np.float32], band_share: float) -> NDArray[np.float32]:
        """Return by how much a pixel of weight one has raised its own colour, by band."""
        mass = np.zeros(BANDS)
        _band_mass(self._rows, weight, mass)
        padded = np.zeros(BANDS + 2)
        padded[1:-1] = mass
        near = mass + 0.5 * (padded[:-2] + padded[2:])
        total = max(float(mass.sum()), 1e-6)
        own = np.where(near > 0, band_share / np.maximum(near, 1e-6), 0)
        return (self._left_out * (own + (1 - band_share) / total)).astype(np.float32)


@kernel('f4[:,::1], f4[:,::1], f8[::1]')
def _band_mass(
    rows: NDArray[np.float32], weight: NDArray[np.float32], mass: NDArray[np.float64]
) -> None:
    for row in range(rows.shape[0]):
        for col in range(rows.shape[1]):
            band = min(max(int(rows[row, col] * BANDS), 0), BANDS - 1)
            mass[band] += weight[row, col]


def _alike_nearby(
    bins: NDArray[np.uint16], inside: NDArray[np.bool_], radius: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """
    Return the uncertain pixels near each uncertain one that have its colour, itself as well.

    They are looked up again and again, so they are sought once.

    :returns: (h w + 1,) int32, where those of each pixel begin, and their places in the window.
    """
    first = np.zeros(bins.size + 1, np.int32)
    across, along = (min(2 * radius + 1, size) for size in bins.shape)
    places = np.empty(int(np.count_nonzero(inside)) * across * along, np.int32)
    count = _find_alike(bins, inside, radius, first, places)
    return first, places[:count].copy()


@kernel('u2[:,::1], b1[:,::1], i8, i4[::1], i4[::1]')
def _find_alike(
    bins: NDArray[np.uint16],
    inside: NDArray[np.bool_],
    radius: int,
    first: NDArray[np.int32],
    places: NDArray[np.int32],
) -> int:
    height, width = bins.shape
    count = 0
    for row in range(height):
        for col in range(width):
            if inside[row, col]:
                index = bins[row, col]
                for r in range(max(0, row - radius), min(height, row + radius + 1)):
                    for c in range(max(0, col - radius), min(width, col + radius + 1)):
                        if bins[r, c] == index and inside[r, c]:
                            places[count] = r * width + c
                            count += 1
            first[row * width + col + 1] = count
    return count


@kernel(
    'u2[:,::1], f4[:,::1], i4[::1], i4[::1], f4[:,::1], f4[:,::1], f4[:,::1], f4[:,::1], '
    'f4[::1], f4[::1], f8, f4[:,::1]',
    fastmath=True,
)
def _log_ratio(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    first: NDArray[np.int32],
    places: NDArray[np.int32],
    soft: NDArray[np.float32],
    rest: NDArray[np.float32],
    person: NDArray[np.float32],
    surroundings: NDArray[np.float32],
    person_gain: NDArray[np.float32],
    rest_gain: NDArray[np.float32],
    floor: float,
    out: NDArray[np.float32],
) -> None:
    height, width = bins.shape
    persons, rests = soft.reshape(-1), rest.reshape(-1)
    for row in range(height):
        for col in range(width):
            band = min(max(int(rows[row, col] * BANDS), 0), BANDS - 1)
            index = bins[row, col]
            near_person = np.float32(0)
            near_rest = np.float32(0)
            pixel = row * width + col
            for k in range(first[pixel], first[pixel + 1]):
                near_person += persons[places[k]]
                near_rest += rests[places[k]]
            p_person = max(person[index, band] - near_person * person_gain[band], floor)
            p_rest = max(surroundings[index, band] - near_rest * rest_gain[band], floor)
            out[row, col] = min(max(np.log(p_person / p_rest), -_LIMIT), _LIMIT)
