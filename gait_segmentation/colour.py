# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Colours of the person and of the surroundings, by height on the body.

One joint Lab histogram per horizontal band of the body and per class.  The histograms are not
smoothed over colour: a colour never seen must give a ratio of one, not an extrapolation of the
tails of its neighbours.  (After the object and background densities of Collins and Liu, ICCV
2003; bands and joint bins are ours.)
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = [
    'BANDS',
    'BINS',
    'BIN_VOLUME',
    'ColourModel',
    'body_rows',
    'colour_bins',
]

BINS = 24
"""Bins along each axis of Lab."""

BANDS = 8
"""Horizontal bands of the body."""

BIN_VOLUME = (256 / BINS) ** 3
"""Volume of a bin: a density times this is the probability of a bin."""

_LEAST_MASS = 1e-7
"""Share of the pixels below which a colour counts as never seen."""


@kernel('u1[:,:,::1], u2[:,::1]')
def _bins(lab: NDArray[np.uint8], out: NDArray[np.uint16]) -> None:
    for row in range(lab.shape[0]):
        pixels, result = lab[row].reshape(-1), out[row]
        for col in range(result.size):
            light, a, b = (
                np.int32(pixels[3 * col]) * BINS >> 8,
                np.int32(pixels[3 * col + 1]) * BINS >> 8,
                np.int32(pixels[3 * col + 2]) * BINS >> 8,
            )
            result[col] = (light * BINS + a) * BINS + b


def colour_bins(lab: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the index of each pixel's joint bin, (h, w) uint16, of a (h, w, 3) Lab image."""
    out = np.empty(lab.shape[:2], np.uint16)
    _bins(lab, out)
    return out


def body_rows(
    shape: tuple[int, int],
    origin: tuple[int, int],
    center: tuple[float, float],
    height: float,
    angle: float = 0.0,
) -> NDArray[np.float32]:
    """
    Return how far down the body each pixel lies: 0 at the head's top, 1 at the soles.

    :param shape: (h, w) of the window.
    :param origin: (x, y) of the window's first pixel in the image.
    :param center: (x, y) of the body's centre.
    :param height: height of the body in pixels.
    :param angle: tilt of the body in radians.
    """
    out = np.empty(shape, np.float32)
    across, along = -math.sin(angle) / height, math.cos(angle) / height
    first = 0.5 + across * (origin[0] + 0.5 - center[0]) + along * (origin[1] + 0.5 - center[1])
    _plane(first, across, along, out)
    return out


@kernel('f8, f8, f8, f4[:,::1]')
def _plane(first: float, across: float, along: float, out: NDArray[np.float32]) -> None:
    step = np.float32(across)
    for row in range(out.shape[0]):
        start = np.float32(first + along * row)
        for col in range(out.shape[1]):
            out[row, col] = start + step * np.float32(col)


@njit(nogil=True, fastmath=True, inline='always')
def _count(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    weight: NDArray[np.float32] | NDArray[np.bool_],
    newest: NDArray[np.float32],
    places: NDArray[np.int32],
    listed: NDArray[np.int32],
    length: int,
) -> tuple[float, int]:
    """Add up the weights; list the bins that were not in use; return total and list's length."""
    total = 0.0
    scale = np.float32(BANDS)
    for row in range(bins.shape[0]):
        weights, index_of, down = weight[row], bins[row], rows[row]
        for col in range(weights.size):
            w = np.float32(weights[col])
            if w > 0:
                index = index_of[col]
                place = places[index]
                if place < 0:
                    place = length
                    places[index] = place
                    listed[place] = index
                    length += 1
                band = min(max(int(down[col] * scale), 0), BANDS - 1)
                newest[place, band] += w
                total += w
    return total, length


@njit(nogil=True, fastmath=True, inline='always')
def _blend(
    histogram: NDArray[np.float32],
    newest: NDArray[np.float32],
    total: float,
    rate: float,
    floor: float,
    places: NDArray[np.int32],
    listed: NDArray[np.int32],
    length: int,
    out: NDArray[np.float32],
) -> int:
    """Move the bins in use towards the newest; drop those all but empty from the list."""
    keep = np.float32(1 - rate)
    gain = np.float32(rate / total)
    kept = 0
    for k in range(length):
        index = listed[k]
        mass = np.float32(0)
        for band in range(BANDS):
            value = keep * histogram[k, band] + gain * newest[k, band]
            histogram[kept, band] = value
            newest[k, band] = 0
            mass += value
        if mass < _LEAST_MASS:
            places[index] = -1
            out[index, :] = np.float32(floor)
        else:
            places[index] = kept
            listed[kept] = index
            kept += 1
    histogram[kept:length] = 0
    return kept


@njit(nogil=True, fastmath=True, inline='always')
def _mix(
    histogram: NDArray[np.float32],
    band_share: float,
    floor: float,
    listed: NDArray[np.int32],
    length: int,
    out: NDArray[np.float32],
) -> None:
    """Mix each band with its neighbours (half weight) and with the whole body."""
    mass = np.zeros(BANDS)
    for k in range(length):
        for band in range(BANDS):
            mass[band] += histogram[k, band]
    total = max(mass.sum(), 1e-12)
    own = np.zeros(BANDS, np.float32)
    for band in range(BANDS):
        near = mass[band]
        if band > 0:
            near += 0.5 * mass[band - 1]
        if band < BANDS - 1:
            near += 0.5 * mass[band + 1]
        own[band] = band_share / near if near > 1e-9 else 0.0
    every = np.float32((1 - band_share) / total)
    low = np.float32(floor)
    half = np.float32(0.5)
    for k in range(length):
        h = histogram[k]
        whole = h[0]
        for band in range(1, BANDS):
            whole += h[band]
        for band in range(BANDS):
            near = h[band]
            if band > 0:
                near += half * h[band - 1]
            if band < BANDS - 1:
                near += half * h[band + 1]
            out[listed[k], band] = own[band] * near + every * whole + low


@kernel(
    'u2[:,::1], f4[:,::1], b1[:,::1], f8, f8, f8, f4[:,::1], f4[:,::1], i4[::1], i4[::1], '
    'i8, f4[:,::1]',
    'u2[:,::1], f4[:,::1], f4[:,::1], f8, f8, f8, f4[:,::1], f4[:,::1], i4[::1], i4[::1], '
    'i8, f4[:,::1]',
    fastmath=True,
)
def _learn(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    weight: NDArray[np.float32] | NDArray[np.bool_],
    rate: float,
    band_share: float,
    floor: float,
    histogram: NDArray[np.float32],
    newest: NDArray[np.float32],
    places: NDArray[np.int32],
    listed: NDArray[np.int32],
    before: int,
    table: NDArray[np.float32],
) -> int:
    """Take in the pixels of a window and fill in the table; return how many bins are in use."""
    total, length = _count(bins, rows, weight, newest, places, listed, before)
    if total <= 0:
        return before
    share = rate if before else 1.0
    kept = _blend(histogram, newest, total, share, floor, places, listed, length, table)
    _mix(histogram, band_share, floor, listed, kept, table)
    return kept


class ColourModel:
    """
    Histograms of one class: probability of a joint bin in a band.

    ``table`` is (BINS^3, BANDS) float32, ready for look-up, floor included.
    """

    def __init__(self, band_share: float, floor: float) -> None:
        """Make an empty model; every colour then has the probability ``floor``."""
        self.band_share = band_share
        self.floor = floor
        # Of the bins in use only, a few hundred, which thus lie together in memory.
        self._histogram = np.zeros((BINS**3, BANDS), np.float32)
        self._newest = np.zeros_like(self._histogram)
        self._listed = np.zeros(BINS**3, np.int32)
        self._length = 0
        # Where in these each bin is, -1 if it is not in use.
        self._places = np.full(BINS**3, -1, np.int32)
        self.table = np.full_like(self._histogram, floor)

    def learn(
        self,
        bins: NDArray[np.uint16],
        rows: NDArray[np.float32],
        weight: NDArray[np.float32] | NDArray[np.bool_],
        rate: float,
    ) -> None:
        """
        Move the histograms towards the weighted pixels of a window.

        :param bins: (h, w) joint bins.
        :param rows: (h, w) position down the body, see :func:`body_rows`.
        :param weight: (h, w) float32 or bool weights of the pixels, 0 = not of this class.
        :param rate: share of the newest pixels; the first call takes them whole.
        """
        self._length = _learn(
            bins,
            rows,
            weight,
            rate,
            self.band_share,
            self.floor,
            self._histogram,
            self._newest,
            self._places,
            self._listed,
            self._length,
            self.table,
        )

    def whole(self) -> NDArray[np.float32]:
        """Return the histogram of the whole body, (BINS^3,) float32 with sum one."""
        whole = np.zeros(BINS**3, np.float32)
        used = self._length
        whole[self._listed[:used]] = self._histogram[:used].sum(axis=1)
        total = float(whole.sum())
        return whole / np.float32(total) if total > 0 else whole
