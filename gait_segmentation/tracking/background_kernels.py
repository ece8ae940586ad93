# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes over the pixels of the remembered background, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    'PLACE_STEPS',
    'SURE_COUNT',
    'compare',
    'count_misplacements',
    'count_residuals',
    'place_in',
    'square_slopes',
    'update_sums',
]

_MAX_COUNT = 30.0
_LEAST_RATE = 0.04
_SAMPLE_STEP = 3
_HIDDEN_DECAY = 0.995
SURE_COUNT = 2.0
"""Times a pixel was seen to be sure what is there."""

_KNOWN_COUNT = 0.25
PLACE_STEPS = 16
"""Parts of a pixel in which misplacements are counted."""


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def update_sums(
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
def _add_slopes(
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
def square_slopes(
    sums: NDArray[np.float32], top: int, left: int, out: NDArray[np.float32]
) -> None:
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
            _add_slopes(above[channel], here[channel], below[channel], use, place)


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
def count_misplacements(
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
    half, steps = np.float32(0.5), np.float32(PLACE_STEPS)
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
def count_residuals(
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
def place_in(histogram: NDArray[np.int64], least: float) -> float:
    """Return the first place up to which the counts add up to at least that many."""
    total = 0
    for place in range(histogram.size):
        total += histogram[place]
        if total >= least:
            return float(place)
    return float(histogram.size)


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def compare(
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
    floor, sure = np.float32(shadow_floor), np.float32(SURE_COUNT)
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
