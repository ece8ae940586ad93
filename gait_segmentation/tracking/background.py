# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings look like pixel by pixel, carried along with the camera's motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import compose
from gait_segmentation.images import Window
from gait_segmentation.tracking.resampling import resample

__all__ = ['BackgroundModel']

_MAX_COUNT = 30.0
_LEAST_RATE = 0.04
_WARP_DECAY = 0.98
_SAMPLE_STEP = 3
_LEAST_SAMPLES = 50
_HIDDEN_DECAY = 0.995
_SURE_COUNT, _CONTRADICTION = 2.0, 4.0
"""
Times a pixel was seen to be sure what is there, and distance from it, in ``sigma``, that tells
something else is there now.
"""

_KNOWN_COUNT = 0.25
_STEEP = 4.0
"""Slope per pixel, in ``sigma``, from which residuals tell of a wrong place."""

_NOISE_PLACE, _PLACE_MOST = 0.25, 1.5
"""What noise alone makes of steep pixels, and the most that is believed, in pixels."""

_PLACE_RATE, _PLACE_STEPS = 0.5, 16

_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 5.0, 2.5, 14.0


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def _update(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
) -> None:
    """Take in the pixels of a window; by lines, so that the distances in memory are known."""
    decay, zero, one = np.float32(_HIDDEN_DECAY), np.float32(0), np.float32(1)
    rate, most = np.float32(_LEAST_RATE), np.float32(_MAX_COUNT)
    few = np.float32(1 / _LEAST_RATE - 1)
    for row in range(top, bottom):
        line = sums[row].reshape(-1)[4 * left : 4 * right]
        pixels = lab[row].reshape(-1)[3 * left : 3 * right]
        hidden = person[row, left:right]
        for col in range(hidden.size):
            count = line[4 * col + 3]
            slow = count > few
            after = min(count + one, most)
            keep = (one - rate) * after / max(count, few) if slow else one
            gain = rate * after if slow else one
            if hidden[col] != 0:
                keep, gain = decay, zero
            for channel in range(3):
                place = 4 * col + channel
                line[place] = keep * line[place] + gain * np.float32(pixels[3 * col + channel])
            line[4 * col + 3] = keep * count + gain


@njit(nogil=True, fastmath=True, error_model='numpy', inline='always')
def _means_of_row(
    line: NDArray[np.float32],
    light: NDArray[np.float32],
    a: NDArray[np.float32],
    b: NDArray[np.float32],
    known: NDArray[np.float32],
) -> None:
    """Fill in the means of a row of pixels, and 1 where they are known, else 0."""
    zero, one, least = np.float32(0), np.float32(1), np.float32(_KNOWN_COUNT)
    for col in range(known.size):
        count = line[4 * col + 3]
        share = one / max(count, least)
        light[col] = line[4 * col] * share
        a[col] = line[4 * col + 1] * share
        b[col] = line[4 * col + 2] * share
        known[col] = one if count >= least else zero


@njit(nogil=True, fastmath=True, inline='always')
def _square_slopes(
    above: NDArray[np.float32],
    here: NDArray[np.float32],
    below: NDArray[np.float32],
    use: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add the squared slopes of a row, but for its ends."""
    half = np.float32(0.5)
    columns = out.size
    left, right, up, down = here[: columns - 2], here[2:], above[1:-1], below[1:-1]
    inner, weight = out[1:-1], use[1:-1]
    for col in range(columns - 2):
        x, y = half * (right[col] - left[col]), half * (down[col] - up[col])
        inner[col] += weight[col] * (x * x + y * y)


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def _slopes(sums: NDArray[np.float32], top: int, left: int, out: NDArray[np.float32]) -> None:
    """Fill in the squared slopes of lightness and of chroma, zero next to what is unknown."""
    rows, columns = out.shape[1], out.shape[2]
    out[:] = np.float32(0)
    if rows < 3 or columns < 3:
        return
    # Of three rows: lightness, a, b and where they are known.
    means = np.empty((3, 4, columns), np.float32)
    use = np.zeros(columns, np.float32)
    span = slice(4 * left, 4 * (left + columns))
    for row in range(2):
        each, line = means[row], sums[top + row].reshape(-1)[span]
        _means_of_row(line, each[0], each[1], each[2], each[3])
    for row in range(1, rows - 1):
        above, here, below = means[(row - 1) % 3], means[row % 3], means[(row + 1) % 3]
        line = sums[top + row + 1].reshape(-1)[span]
        _means_of_row(line, below[0], below[1], below[2], below[3])
        over, under, known = above[3], below[3], here[3]
        for col in range(1, columns - 1):
            use[col] = over[col] * under[col] * known[col - 1] * known[col + 1]
        for channel in range(3):
            place = out[min(channel, 1), row]
            _square_slopes(above[channel], here[channel], below[channel], use, place)


@njit(nogil=True, fastmath=True, error_model='numpy', inline='always')
def _lightness_of_row(
    line: NDArray[np.float32], light: NDArray[np.float32], known: NDArray[np.float32]
) -> None:
    """Fill in the mean lightness of a row of pixels, and 1 where it is sure, else 0."""
    zero, one = np.float32(0), np.float32(1)
    for col in range(light.size):
        count = line[4 * col + 3]
        light[col] = line[4 * col] / max(count, one)
        known[col] = one if count >= one else zero


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def _misplacements(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    least: float,
    histogram: NDArray[np.int64],
) -> int:
    """Count residuals of lightness over its slope, in sixteenths of a pixel, where it is steep."""
    total, columns = 0, right - left
    if min(bottom - top, columns) < 3:
        return total
    half, steps = np.float32(0.5), np.float32(_PLACE_STEPS)
    steep = np.float32(least * least)
    # Of three rows: lightness and where it is known.
    means, known = np.empty((3, columns), np.float32), np.empty((3, columns), np.float32)
    squares = np.empty(columns, np.float32)
    span = slice(4 * left, 4 * right)
    _lightness_of_row(sums[top].reshape(-1)[span], means[2], known[2])
    for row in range(top + 1, bottom - 1, 2):
        means[0], known[0] = means[2], known[2]
        _lightness_of_row(sums[row].reshape(-1)[span], means[1], known[1])
        _lightness_of_row(sums[row + 1].reshape(-1)[span], means[2], known[2])
        above, here, below = means[0], means[1], means[2]
        over, sure, under = known[0], known[1], known[2]
        for col in range(1, columns - 1):
            y, x = half * (below[col] - above[col]), half * (here[col + 1] - here[col - 1])
            use = over[col] * under[col] * sure[col] * sure[col - 1] * sure[col + 1]
            squares[col] = use * (x * x + y * y)
        pixels, hidden = lab[row].reshape(-1)[3 * left : 3 * right], person[row, left:right]
        for col in range(1, columns - 1, 2):
            if squares[col] >= steep and hidden[col] == 0:
                total += 1
                off = abs(np.float32(pixels[3 * col]) - here[col]) / np.sqrt(squares[col])
                histogram[min(int(steps * off), histogram.size - 1)] += 1
    return total


@njit(cache=True, nogil=True, error_model='numpy')
def _residuals(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    histogram: NDArray[np.int64],
) -> int:
    """Count the residuals of all channels of known pixels by quarter grey levels."""
    total = 0
    one, four = np.float32(1), np.float32(4)
    for row in range(top, bottom, _SAMPLE_STEP):
        line, pixels, hidden = sums[row].reshape(-1), lab[row].reshape(-1), person[row]
        for col in range(left, right, _SAMPLE_STEP):
            count = line[4 * col + 3]
            if hidden[col] == 0 and count >= one:
                total += 1
                for channel in range(3):
                    mean = line[4 * col + channel] / count
                    off = abs(np.float32(pixels[3 * col + channel]) - mean)
                    histogram[min(int(four * off), histogram.size - 1)] += 1
    return total


@njit(cache=True, nogil=True)
def _place(histogram: NDArray[np.int64], least: float) -> float:
    """Return the first place up to which the counts add up to at least that many."""
    total = 0
    for place in range(histogram.size):
        total += histogram[place]
        if total >= least:
            return float(place)
    return float(histogram.size)


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def _compare(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    top: int,
    left: int,
    bound: float,
    shadow_floor: float,
    out: NDArray[np.uint8],
) -> None:
    """Mark what is sure to be something else than the background, from a pixel of ``sums`` on."""
    one, most = np.float32(1), np.float32(bound * bound)
    floor, sure = np.float32(shadow_floor), np.float32(_SURE_COUNT)
    for row in range(out.shape[0]):
        line = sums[top + row].reshape(-1)[4 * left : 4 * (left + out.shape[1])]
        pixels, result = lab[row].reshape(-1), out[row]
        for col in range(result.size):
            count = line[4 * col + 3]
            share = one / max(count, sure)
            base, light = line[4 * col] * share, np.float32(pixels[3 * col])
            off_a = np.float32(pixels[3 * col + 1]) - line[4 * col + 1] * share
            off_b = np.float32(pixels[3 * col + 2]) - line[4 * col + 2] * share
            chroma = off_a * off_a + off_b * off_b
            other = chroma + (light - base) * (light - base) > most
            shadow = (chroma <= most) & (floor * base < light) & (light < base)
            result[col] = (count >= sure) & other & (not shadow)


class BackgroundModel:
    """
    Running mean of each pixel of the surroundings in Lab, and how often it was seen.

    ``sums`` is (h, w, 4) float32: L, a, b, each times the count, and the count, so that the
    moved model is a warp of the sums; unknown pixels are zero.  ``sigma`` is the spread of a pixel
    about its mean in grey levels, measured on the surroundings: it grows by itself where parallax
    or a bad registration spoils the model, which makes the model safe there.  ``misplacement`` is
    how far the model lies off the frame, in pixels, measured where it is steep: sharp edges differ
    by that even if the camera's motion is known well, since each motion blurs the model.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make a model that knows nothing yet, for a working image of the given (h, w)."""
        self.sums = np.zeros((*shape, 4), np.float32)
        self.sigma = _SIGMA_START
        self.misplacement = 0.0
        # Outside of these all is unknown; anything may be known if it is None.
        self._known: list[Window] | None = None

    @property
    def count(self) -> NDArray[np.float32]:
        """Return how often each pixel was seen, (h, w) float32."""
        return self.sums[..., 3]

    @property
    def mean(self) -> NDArray[np.float32]:
        """Return the mean of each pixel, (h, w, 3) float32, zero where it is unknown."""
        return self.sums[..., :3] / np.maximum(self.sums[..., 3:], np.float32(1e-6))

    def part(self, window: Window) -> tuple[NDArray[np.float32], int, int]:
        """Return contiguous sums that hold a window, and the row and column it begins in."""
        rows, columns = window
        if rows.step is None and columns.step is None:
            return self.sums, rows.start, columns.start
        return np.ascontiguousarray(self.sums[window]), 0, 0

    def contradicted(
        self, lab: NDArray[np.uint8], window: Window, shadow_floor: float
    ) -> NDArray[np.uint8]:
        """
        Return where a frame does not look like the known background, (h, w) uint8 0/1.

        :param lab: (h, w, 3) uint8, the window of the frame.
        :param window: its rows and columns.
        :param shadow_floor: darkest shadow, as a share of the lightness; shadows are background.
        """
        out = np.empty(lab.shape[:2], np.uint8)
        bound = _CONTRADICTION * self.sigma
        sums, top, left = self.part(window)
        _compare(sums, lab, top, left, bound, shadow_floor, out)
        return out

    def forget(self, where: NDArray[np.uint8]) -> None:
        """
        Forget some pixels.

        :param where: (h, w) uint8, non-zero where to forget.
        """
        self.sums[where > 0] = 0

    def recall(self, mean: NDArray[np.uint8], count: NDArray[np.uint8], window: Window) -> None:
        """
        Take over what is known from elsewhere, where less is known here.

        :param mean: (h, w, 3) uint8 Lab, the window.
        :param count: (h, w) uint8, how often each pixel was seen.
        :param window: its rows and columns.
        """
        self._known = None
        sums = self.sums[window]
        more = count > sums[..., 3]
        weight = count[more].astype(np.float32)
        sums[more, :3] = mean[more] * weight[:, None]
        sums[more, 3] = weight

    def moved(
        self,
        motions: list[NDArray[np.float64] | None],
        windows: Sequence[Window] | None = None,
        *,
        into: BackgroundModel | None = None,
    ) -> BackgroundModel:
        """
        Return the model as it looks after some motions of the camera; this one stays.

        :param motions: transforms as for :meth:`move`, oldest first.
        :param windows: the rows and columns to keep, all if None.
        :param into: a model of the same size that is no longer needed, to be filled in anew.
        """
        made = [motion for motion in motions if motion is not None]
        if not made:
            return self
        total = made[0]
        for motion in made[1:]:
            total = compose(motion, total)
        other = BackgroundModel((0, 0)) if into is None or into is self else into
        self._carry(total, _WARP_DECAY ** len(made), windows, other)
        return other

    def move(
        self, motion: NDArray[np.float64] | None, windows: Sequence[Window] | None = None
    ) -> None:
        """
        Carry the model along with the camera.

        :param motion: 2 x 3 transform of positions from the last frame to this one, None for a
            camera that stands still (nothing is resampled then).
        :param windows: the rows and columns to keep, all if None; when nothing moves, all are.
        """
        if motion is not None:
            self.sums = self.moved([motion], windows).sums

    @property
    def _all(self) -> list[Window]:
        return [(slice(0, self.sums.shape[0]), slice(0, self.sums.shape[1]))]

    def _carry(
        self,
        motion: NDArray[np.float64],
        decay: float,
        windows: Sequence[Window] | None,
        other: BackgroundModel,
    ) -> None:
        """Fill another model in with this one as it looks after a motion."""
        wanted = None if windows is None else list(windows)
        if other.sums.shape != self.sums.shape:
            # Not zeros_like, which fills what calloc would leave to be filled when touched.
            other.sums = np.zeros(self.sums.shape, np.float32)
        elif wanted is not None and other._known != wanted:
            for window in self._all if other._known is None else other._known:
                other.sums[window] = 0
        other._known = wanted
        other.sigma, other.misplacement = self.sigma, self.misplacement
        for window in self._all if windows is None else windows:
            resample(self.sums, motion, decay, window, other.sums)

    def slopes(self, window: Window) -> NDArray[np.float32]:
        """
        Return how steep the background is, (2, h, w) float32.

        :param window: rows and columns to look at.
        :returns: squared change per pixel of lightness and of chroma, zero where unknown.
        """
        sums, top, left = self.part(window)
        out = np.empty((2, *self.count[window].shape), np.float32)
        _slopes(sums, top, left, out)
        return out

    def learn(
        self,
        lab: NDArray[np.uint8],
        person: NDArray[np.uint8],
        windows: Sequence[Window] | None = None,
    ) -> None:
        """
        Take in one frame.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be: not learnt.
        :param windows: the rows and columns to learn, disjoint; all if None.
        """
        if self._known != windows:
            self._known = None
        for part in self._all if windows is None else windows:
            _update(self.sums, lab, person, *_bounds(part))

    def measure_noise(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        """
        Update ``sigma`` and ``misplacement`` from the residuals about the person.

        Before the frame is learnt.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be.
        :param windows: the rows and columns to look at.
        """
        histogram = np.zeros(4 * 256, np.int64)
        total = 0
        for part in windows:
            total += _residuals(self.sums, lab, person, *_bounds(part), histogram)
        if total < _LEAST_SAMPLES:
            return
        spread = 1.2 * 1.4826 * (_place(histogram, 1.5 * total) + 0.5) / 4 + 1.5
        self.sigma = min(max(0.9 * self.sigma + 0.1 * spread, _SIGMA_LOW), _SIGMA_HIGH)
        self._measure_misplacement(lab, person, windows)

    def _measure_misplacement(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        histogram = np.zeros(4 * _PLACE_STEPS, np.int64)
        total, least = 0, _STEEP * self.sigma
        for part in windows:
            total += _misplacements(self.sums, lab, person, *_bounds(part), least, histogram)
        if total < _LEAST_SAMPLES:
            return
        median = (_place(histogram, 0.5 * total) + 0.5) / _PLACE_STEPS
        spread = 1.4826 * median
        measured = min(max(spread**2 - _NOISE_PLACE**2, 0.0) ** 0.5, _PLACE_MOST)
        self.misplacement += _PLACE_RATE * (measured - self.misplacement)


def _bounds(window: Window) -> tuple[int, int, int, int]:
    """Return the first row and the one after the last, and the same of the columns."""
    rows, columns = window
    return rows.start, rows.stop, columns.start, columns.stop
