# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The rhythm of a walk: period, heel contacts, and the templates of one stride.

The period is where the normalised autocorrelation of registered silhouettes peaks (the practice of
Makihara and colleagues).  In profile the two halves of a stride look alike, so the first peak is a
step and the stride is two of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import BankError

SHORTEST_STEP, LONGEST_STEP = 5, 60  # frames


@dataclass(frozen=True)
class Cycle:
    """Frames from one heel contact to the next (half a stride), and all contacts, ascending."""

    step: float
    contacts: NDArray[np.float64]

    def phase(self, frame: NDArray[np.float64], first: float = 0.0) -> NDArray[np.float64]:
        """Return the growing phase of frames in strides, that of the first contact being given."""
        steps = np.arange(len(self.contacts), dtype=np.float64)
        inside = np.interp(frame, self.contacts, steps)
        before = np.minimum(frame - self.contacts[0], 0.0) / self.step
        after = np.maximum(frame - self.contacts[-1], 0.0) / self.step
        return first + (inside + before + after) / 2


def smooth(values: NDArray[np.float64], window: float) -> NDArray[np.float64]:
    """Average over a centred window that shrinks at the ends."""
    half = min(max(round(window / 2), 0), (len(values) - 1) // 2)
    sums = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(len(values))
    reach = np.minimum(half, np.minimum(index, len(values) - 1 - index))
    return (sums[index + reach + 1] - sums[index - reach]) / (2 * reach + 1)


def autocorrelation(registered: NDArray[np.uint8], longest: int) -> NDArray[np.float64]:
    """Return the normalised autocorrelation of registered silhouettes at lags from 0 on."""
    flat = registered.reshape(len(registered), -1).astype(np.float64)
    flat = flat - flat.mean(axis=0)
    product = flat @ flat.T
    energy = np.diag(product)
    result = np.empty(longest + 1)
    for lag in range(longest + 1):
        end = len(flat) - lag
        scale = math.sqrt(float(energy[:end].sum() * energy[lag:].sum()))
        result[lag] = float(np.trace(product, offset=lag)) / scale if scale > 0 else 0.0
    return result


def _vertex(values: NDArray[np.float64], at: int) -> float:
    """Return the place of a peak between samples, by the parabola through three of them."""
    if not 0 < at < len(values) - 1:
        return float(at)
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return at + (0.5 * float((left - right) / bend) if bend < 0 else 0.0)


def find_step(registered: NDArray[np.uint8], profile: bool = True) -> float:
    """Return the frames a step; in profile both halves of a stride look alike."""
    longest = min(2 * LONGEST_STEP, len(registered) - 4)
    if longest < 2 * SHORTEST_STEP:
        raise BankError(
            f'a sequence needs at least {2 * SHORTEST_STEP + 4} silhouettes, got {len(registered)}'
        )
    values = autocorrelation(registered, longest)
    inner = np.arange(SHORTEST_STEP, longest)
    peaks = inner[(values[inner] >= values[inner - 1]) & (values[inner] > values[inner + 1])]
    if peaks.size == 0 or values[peaks].max() < 0.1:
        raise BankError(
            f'{len(registered)} silhouettes show no period: one stride at least of a person '
            'walking past is needed'
        )
    # In profile the peaks at a step and at a stride are about as high; the first one is meant.
    strong = peaks[values[peaks] >= (0.5 if profile else 0.8) * values[peaks].max()]
    step = _vertex(values, int(strong[0])) / (1 if profile else 2)
    twice = round(2 * step)
    near = [k for k in peaks if abs(int(k) - twice) <= max(2, round(0.2 * step))]
    if near:
        # The stride's peak is the same period measured over twice the time.
        step = _vertex(values, int(max(near, key=lambda k: values[k]))) / 2
    if step > LONGEST_STEP:
        raise BankError(
            f'a step must take at most {LONGEST_STEP} frames, the silhouettes repeat after '
            f'{step:.1f}: is the frame rate very high?'
        )
    return step


def step_width(registered: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return how wide the legs are apart: the spread of the lowest fifth, in columns."""
    rows = np.flatnonzero(registered.any(axis=(0, 2)))
    lowest = rows[-1] + 1 - max((rows[-1] + 1 - rows[0]) // 5, 1)
    mass = registered[:, lowest : rows[-1] + 1].sum(axis=1, dtype=np.float64)
    columns = np.arange(registered.shape[2], dtype=np.float64)
    total = np.maximum(mass.sum(axis=1), 1e-9)
    mean = (mass @ columns) / total
    spread = (mass * (columns - mean[:, None]) ** 2).sum(axis=1) / total
    return np.sqrt(spread)


def find_contacts(registered: NDArray[np.uint8], step: float) -> Cycle:
    """Find the heel contacts: where the legs are farthest apart."""
    width = smooth(step_width(registered), step / 8)
    frames = np.arange(len(width))
    wave = np.sum((width - width.mean()) * np.exp(-2j * np.pi * frames / step))
    # The wave's crests are at first + k * step; each contact is sought round its crest.
    first = (-float(np.angle(wave)) / (2 * np.pi) * step) % step
    contacts = []
    for crest in np.arange(first, len(width) - 0.5, step):
        low = max(math.ceil(crest - step / 4), 0)
        high = min(math.floor(crest + step / 4) + 1, len(width))
        peak = low + int(np.argmax(width[low:high]))
        inside = low < peak < high - 1
        contacts.append(_vertex(width, peak) if inside else float(crest))
    if len(contacts) < 3:
        raise BankError(
            f'{len(registered)} silhouettes with a step every {step:.1f} frames hold fewer than '
            'three heel contacts; at least one whole stride is needed'
        )
    return Cycle(step, np.array(contacts))


def _moment(registered: NDArray[np.float64], frame: float) -> NDArray[np.float64]:
    """Interpolate linearly between two frames."""
    before = min(math.floor(frame), len(registered) - 2)
    share = frame - before
    return (1 - share) * registered[before] + share * registered[before + 1]


def cycle_templates(
    registered: NDArray[np.uint8], cycle: Cycle, phases: int, first: float = 0.0
) -> NDArray[np.uint8]:
    """Resample a sequence to the phases of one stride; several strides are averaged."""
    frames = np.arange(len(registered), dtype=np.float64)
    phase = cycle.phase(frames, first)
    values = registered.astype(np.float64)
    result = np.empty((phases, *registered.shape[1:]), dtype=np.uint8)
    for k in range(phases):
        low = math.ceil(phase[0] - k / phases - 1e-9)
        high = math.floor(phase[-1] - k / phases + 1e-9)
        if high < low:
            raise BankError(f'the silhouettes do not cover phase {k / phases:.2f} of a stride')
        moments = np.interp(np.arange(low, high + 1) + k / phases, phase, frames)
        mean = np.mean([_moment(values, moment) for moment in moments], axis=0)
        result[k] = np.floor(mean + 0.5).astype(np.uint8)
    return result
