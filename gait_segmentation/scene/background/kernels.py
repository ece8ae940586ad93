# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes over the pixels of the remembered background, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['LIMIT', 'SAMPLE_STEP', 'SURE_COUNT', 'sample_residuals', 'update_sums', 'weigh']

_LEAST_RATE = 0.04
SAMPLE_STEP = 3
_HIDDEN_DECAY = 0.995
SURE_COUNT = 2.0
"""Times a pixel was seen to be sure what is there."""

_NEUTRAL, _GAIN, LIMIT = 4.0, 0.75, 3.0
"""
Half the squared distance in ``sigma`` that says nothing, evidence per step, and its limit, which
is reached four ``sigma`` away.
"""


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
    rate, most = np.float32(_LEAST_RATE), np.float32(1 / _LEAST_RATE)
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


@kernel(
    'f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8, f8, f4[::1], f4[::1]',
    error_model='numpy',
)
def sample_residuals(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    steep: float,
    residuals: NDArray[np.float32],
    places: NDArray[np.float32],
) -> tuple[int, int]:
    """
    Put residuals of known pixels one after the other, and those of lightness over its slope.

    Without branches: what does not count is written over by what comes next.

    :param steep: least slope per pixel that counts.
    :returns: how many there are of each.
    """
    found = steeps = 0
    one, least = np.float32(1), np.float32(steep * steep)
    for row in range(top, bottom, SAMPLE_STEP):
        above, below = max(row - 1, top), min(row + 1, bottom - 1)
        for col in range(left, right, SAMPLE_STEP):
            before, after = max(col - 1, left), min(col + 1, right - 1)
            count = sums[row, col, 3]
            for channel in range(3):
                mean = sums[row, col, channel] / count
                residuals[found + channel] = abs(np.float32(lab[row, col, channel]) - mean)
            up, low = sums[above, col, 3], sums[below, col, 3]
            near, far = sums[row, before, 3], sums[row, after, 3]
            down = (sums[below, col, 0] / low - sums[above, col, 0] / up) / 2
            across = (sums[row, after, 0] / far - sums[row, before, 0] / near) / 2
            square = np.float32(down * down + across * across)
            places[steeps] = residuals[found] / np.sqrt(square)
            known = (person[row, col] == 0) & (count >= one)
            inner = (above < row) & (row < below) & (before < col) & (col < after)
            found += 3 * known
            around = min(min(up, low), min(near, far)) >= one
            steeps += known & inner & around & (square >= least)
    return found, steeps


@kernel('f4[:,:,::1], u1[:,:,::1], i8, i8, f8, f8, f4[:,::1]', fastmath=True, error_model='numpy')
def weigh(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    top: int,
    left: int,
    sigma: float,
    shadow_floor: float,
    out: NDArray[np.float32],
) -> None:
    """
    Fill in log-odds that pixels are not the background, from a pixel of ``sums`` on.

    Without branches, so that many pixels are done at once.
    """
    one, zero = np.float32(1), np.float32(0)
    # Seen that often, though hidden for a time since.
    sure = np.float32(SURE_COUNT - 0.5)
    gain, neutral, limit = np.float32(_GAIN), np.float32(_NEUTRAL), np.float32(LIMIT)
    scale, floor = np.float32(1 / (2 * sigma * sigma)), np.float32(shadow_floor)
    steepness, middle = np.float32(1 / max(1 - shadow_floor, 1e-6)), np.float32(128)
    for row in range(out.shape[0]):
        line = sums[top + row].reshape(-1)[4 * left : 4 * (left + out.shape[1])]
        pixels, result = lab[row].reshape(-1), out[row]
        for col in range(result.size):
            count = line[4 * col + 3]
            share = one / max(count, sure)
            base, light = line[4 * col] * share, np.float32(pixels[3 * col])
            base_a, base_b = line[4 * col + 1] * share, line[4 * col + 2] * share
            a, b = np.float32(pixels[3 * col + 1]), np.float32(pixels[3 * col + 2])
            off_a, off_b, off = a - base_a, b - base_b, light - base
            chroma = off_a * off_a + off_b * off_b
            value = scale * (chroma + off * off) - neutral
            # A shadow takes colour away in proportion to the light, or leaves it.
            part = light / max(base, one)
            less_a, less_b = a - middle - part * (base_a - middle), b - middle
            less_b -= part * (base_b - middle)
            shaded = scale * min(chroma, less_a * less_a + less_b * less_b)
            shaded -= neutral * (one - (one - part) * steepness)
            shaded = min(value, shaded)
            value = shaded if (floor < part) & (part < one) else value
            value = min(max(gain * value, -limit), limit)
            result[col] = value if count >= sure else zero
