# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Colours of the person and of the surroundings, by height on the body.

One joint Lab histogram per horizontal band of the body and per class.  The histograms are not
smoothed over colour: a colour never seen must give a ratio of one, not an extrapolation of the
tails of its neighbours.  (After the object and background densities of Collins and Liu, ICCV
2003; bands and joint bins are ours.)

In a grey image only the brightness would tell a person from the surroundings.  There the local
energy of the gradient, across and down (:func:`gray_lab`), stands where a colour image has a* and
b*: even cloth differs from a wall of the same brightness that has a texture.  (Shape-texture
beside colour after Wang and Yagi, IEEE Transactions on Image Processing 17(2), 2008.)
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

BINS = 24
"""Bins along each axis of Lab."""

BANDS = 8
"""Horizontal bands of the body."""

BIN_VOLUME = (256 / BINS) ** 3
"""Volume of a bin: a density times this is the probability of a bin."""

_NEVER_SEEN = 1e-7  # share of the pixels below which a colour counts as never seen
_ENERGY_SIGMA = 0.8  # of the Gaussian over which energy is gathered, in pixels
_ENERGY_GAIN = 0.3  # levels of a* or b* that a mean gradient of one level a pixel counts

NO_CHROMA = 128.0
"""Level of a* or b* that stands for no colour."""

NO_GRADIENT = 110.0
"""Level of a* or b* that stands for no gradient."""


@kernel('u1[:,:,::1]')
def is_gray(bgr: NDArray[np.uint8]) -> bool:
    """Tell whether the channels of a contiguous (h, w, 3) uint8 image are equal in every pixel."""
    for row in range(bgr.shape[0]):
        for col in range(bgr.shape[1]):
            blue, green, red = bgr[row, col, 0], bgr[row, col, 1], bgr[row, col, 2]
            if blue != green or green != red:
                return False
    return True


def gray_lab(gray: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Return brightness and gradient energy of a grey image in the place of L*, a* and b*.

    :param gray: (h, w) uint8.
    :returns: (h, w, 3) uint8: L* as OpenCV stores it, root mean square of the gradient across
        and of that down.
    """
    bgr = cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR)
    lab = cv2.cvtColor(bgr, cv2.COLOR_BGR2Lab)
    for channel, (across, down) in enumerate(((1, 0), (0, 1)), 1):
        slope = cv2.Sobel(gray, cv2.CV_32F, across, down, ksize=3, scale=0.25)
        energy = cv2.sqrt(cv2.GaussianBlur(cv2.multiply(slope, slope), (0, 0), _ENERGY_SIGMA))
        lab[..., channel] = cv2.convertScaleAbs(energy, alpha=_ENERGY_GAIN, beta=NO_GRADIENT)
    return np.asarray(lab)


@kernel('u1[:,:,::1]')
def colour_bins(lab: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the index of each pixel's joint bin, (h, w) uint16, of a (h, w, 3) Lab image."""
    out = np.empty(lab.shape[:2], np.uint16)
    for row in range(lab.shape[0]):
        pixels, result = lab[row].reshape(-1), out[row]
        for col in range(result.size):
            light, a, b = (
                np.int32(pixels[3 * col]) * BINS >> 8,
                np.int32(pixels[3 * col + 1]) * BINS >> 8,
                np.int32(pixels[3 * col + 2]) * BINS >> 8,
            )
            result[col] = (light * BINS + a) * BINS + b
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
    across, along = -math.sin(angle) / height, math.cos(angle) / height
    first = 0.5 + across * (origin[0] + 0.5 - center[0]) + along * (origin[1] + 0.5 - center[1])
    starts = (first + along * np.arange(shape[0])).astype(np.float32)
    return starts[:, None] + np.float32(across) * np.arange(shape[1], dtype=np.float32)


@njit(nogil=True, fastmath=True, inline='always')
def _near(values: NDArray[np.floating], band: int) -> float:
    """Return the value of a band and half of those of its neighbours."""
    near = values[band]
    if band > 0:
        near += np.float32(0.5) * values[band - 1]
    if band < BANDS - 1:
        near += np.float32(0.5) * values[band + 1]
    return near


@kernel(
    'u2[:,::1], f4[:,::1], f4[:,::1], f8, f8, f8, f4[:,::1], b1[::1], f4[:,::1]',
    fastmath=True,
)
def _learn(
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    weight: NDArray[np.float32],
    rate: float,
    band_share: float,
    floor: float,
    histogram: NDArray[np.float32],
    used: NDArray[np.bool_],
    table: NDArray[np.float32],
) -> None:
    """Take in the pixels of a window, and fill in the table of the bins ``used``."""
    newest = np.zeros_like(histogram)
    now = np.zeros_like(used)
    total = 0.0
    for row in range(bins.shape[0]):
        for col in range(bins.shape[1]):
            w = weight[row, col]
            if w > 0:
                index = bins[row, col]
                band = min(max(int(rows[row, col] * np.float32(BANDS)), 0), BANDS - 1)
                newest[index, band] += w
                now[index] = True
                total += w
    if total <= 0:
        return
    share = rate if used.any() else 1.0
    keep, gain = np.float32(1 - share), np.float32(share / total)
    mass = np.zeros(BANDS)
    for index in range(used.size):
        if not (used[index] or now[index]):
            continue
        whole = np.float32(0)
        for band in range(BANDS):
            value = keep * histogram[index, band] + gain * newest[index, band]
            histogram[index, band] = value
            whole += value
        used[index] = whole >= _NEVER_SEEN
        if not used[index]:
            histogram[index] = 0
            table[index] = floor
        for band in range(BANDS):
            mass[band] += histogram[index, band]
    every = np.float32((1 - band_share) / max(mass.sum(), 1e-12))
    own = np.zeros(BANDS, np.float32)
    for band in range(BANDS):
        near = _near(mass, band)
        own[band] = band_share / near if near > 1e-9 else 0.0
    for index in range(used.size):
        if used[index]:
            whole = histogram[index].sum()
            for band in range(BANDS):
                near = _near(histogram[index], band)
                table[index, band] = own[band] * near + every * whole + np.float32(floor)


class ColourModel:
    """Histograms of a class; ``table`` (BINS^3, BANDS) float32 is for look-up, floor included."""

    def __init__(self, band_share: float, floor: float) -> None:
        """Make an empty model; every colour then has the probability ``floor``."""
        self.band_share = band_share
        self.floor = floor
        self._histogram = np.zeros((BINS**3, BANDS), np.float32)
        self._used = np.zeros(BINS**3, np.bool_)
        self.table = np.full_like(self._histogram, floor)

    def accumulate(
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
        _learn(
            bins,
            rows,
            weight.astype(np.float32, copy=False),
            rate,
            self.band_share,
            self.floor,
            self._histogram,
            self._used,
            self.table,
        )

    def fade(self, chroma: float) -> None:
        """Go on as if all that was learnt had the same a* and b*, and its own lightness."""
        light = self._histogram.reshape(BINS, BINS**2, BANDS).sum(axis=1)
        self._histogram[:] = 0
        level = int(chroma * BINS / 256)
        self._histogram[(np.arange(BINS) * BINS + level) * BINS + level] = light
        self._used[:] = self._histogram.any(axis=1)
        self.table[:] = self.floor
        if self._used.any():
            nothing = np.zeros((1, 1), np.uint16)
            one = np.ones((1, 1), np.float32)
            self.accumulate(nothing, np.zeros((1, 1), np.float32), one, 0.0)
