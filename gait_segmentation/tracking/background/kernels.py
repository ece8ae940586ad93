# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes over the pixels of the remembered background, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = [
    'PLACE_STEPS',
    'SURE_COUNT',
    'compare',
    'count_misplacements',
    'count_residuals',
    'lightness_of_row',
    'place_in',
    'update_sums',
    'weigh',
]

_MAX_COUNT = 30.0
_LEAST_RATE = 0.04
_SAMPLE_STEP = 3
_HIDDEN_DECAY = 0.995
SURE_COUNT = 2.0
"""Times a pixel was seen to be sure what is there."""

_NEUTRAL, _GAIN, _LIMIT = 4.0, 0.75, 3.0
"""Half the squared distance in ``sigma`` that says nothing, evidence per step, and its limit."""

PLACE_STEPS = 16
"""Parts of a pixel in which misplacements are counted."""


@kernel('f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8', fastmath=True, error_model='numpy')
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
def lightness_of_row(
    line: NDArray[np.float32],
    least: float,
    light: NDArray[np.float32],
    known: NDArray[np.float32],
) -> None:
    """Fill in the mean lightness of a row, and 1 where pixels were seen that often, else 0."""
    zero, one, fewest = np.float32(0), np.float32(1), np.float32(least)
    for col in range(light.size):
        count = line[4 * col + 3]
        light[col] = line[4 * col] / max(count, fewest)
        known[col] = one if count >= fewest else zero


@kernel(
    'f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8, f8, i8[::1]',
    fastmath=True,
    error_model='numpy',
)
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
    lightness_of_row(sums[top].reshape(-1)[span], 1.0, means[2], known[2])
    for row in range(top + 1, bottom - 1, 2):
        for col in range(columns):
            means[0, col], known[0, col] = means[2, col], known[2, col]
        lightness_of_row(sums[row].reshape(-1)[span], 1.0, means[1], known[1])
        lightness_of_row(sums[row + 1].reshape(-1)[span], 1.0, means[2], known[2])
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


@kernel('f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8, i8[::1]', error_model='numpy')
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


@kernel('f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8, f8', error_model='numpy')
def count_agreeing(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    bound: float,
) -> tuple[int, int]:
    """Count the pixels that are sure, and those of them that look as they are known to."""
    total = agreeing = 0
    one, sure, most = np.float32(1), np.float32(SURE_COUNT), np.float32(bound * bound)
    for row in range(top, bottom, _SAMPLE_STEP):
        line, pixels, hidden = sums[row].reshape(-1), lab[row].reshape(-1), person[row]
        for col in range(left, right, _SAMPLE_STEP):
            count = line[4 * col + 3]
            if hidden[col] == 0 and count >= sure:
                total += 1
                share, squares = one / count, np.float32(0)
                for channel in range(3):
                    mean = line[4 * col + channel] * share
                    off = np.float32(pixels[3 * col + channel]) - mean
                    squares += off * off
                agreeing += squares <= most
    return total, agreeing


@kernel('i8[::1], f8')
def place_in(histogram: NDArray[np.int64], least: float) -> float:
    """Return the first place up to which the counts add up to at least that many."""
    total = 0
    for place in range(histogram.size):
        total += histogram[place]
        if total >= least:
            return float(place)
    return float(histogram.size)


@kernel('f4[:,:,::1], u1[:,:,::1], i8, i8, f8, f8, u1[:,::1]', fastmath=True, error_model='numpy')
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


@kernel('f4[:,:,::1], u1[:,:,::1], i8, i8, f8, f8, f4[:,::1]', error_model='numpy')
def weigh(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    top: int,
    left: int,
    sigma: float,
    shadow_floor: float,
    out: NDArray[np.float32],
) -> None:
    """Fill in log-odds that pixels are not the background, from a pixel of ``sums`` on."""
    one, zero = np.float32(1), np.float32(0)
    # Seen that often, though hidden for a time since.
    sure = np.float32(SURE_COUNT - 0.5)
    gain, neutral, limit = np.float32(_GAIN), np.float32(_NEUTRAL), np.float32(_LIMIT)
    scale, floor = np.float32(1 / (2 * sigma * sigma)), np.float32(shadow_floor)
    middle = np.float32(128)
    for row in range(out.shape[0]):
        line = sums[top + row].reshape(-1)[4 * left : 4 * (left + out.shape[1])]
        pixels, result = lab[row].reshape(-1), out[row]
        for col in range(result.size):
            count = line[4 * col + 3]
            if count < sure:
                result[col] = zero
                continue
            share = one / count
            base, light = line[4 * col] * share, np.float32(pixels[3 * col])
            base_a, base_b = line[4 * col + 1] * share, line[4 * col + 2] * share
            a, b = np.float32(pixels[3 * col + 1]), np.float32(pixels[3 * col + 2])
            chroma = scale * ((a - base_a) ** 2 + (b - base_b) ** 2)
            value = gain * (chroma + scale * (light - base) ** 2 - neutral)
            part = light / max(base, one)
            if floor < part < one:
                # A shadow takes colour away in proportion to the light, or leaves it.
                less_a = a - middle - part * (base_a - middle)
                less_b = b - middle - part * (base_b - middle)
                chroma = min(chroma, scale * (less_a * less_a + less_b * less_b))
                depth = (one - part) / (one - floor)
                value = min(value, gain * (chroma - neutral * (one - depth)))
            result[col] = min(max(value, -limit), limit) * count / (count + one)
