# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The phase of the stride and its rate, as a probability that a steady walk carries along."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ['PhaseClock']

_RATES = 14
_USUAL_RATE, _SPREAD = 0.92, 0.2
"""Strides per second of adults, 110 steps/min, and the standard deviation of its logarithm."""
_STANDING = 0.05
"""Share of people who stand."""
_WANDER = 0.1
"""Standard deviation by which the logarithm of the rate changes in a second."""
_DIFFUSION = 0.02
"""Standard deviation in strides by which the phase leaves an even walk in a second."""
_RENEWAL = 0.02
"""Share of the belief that begins anew in a second: people stop, and the view was wrong."""
_NOISE = 20.0
"""
Evidence that is worth a factor of e.  Flipped pixels alone would give about 8; errors of real
likelihoods are alike in neighbouring pixels.
"""
_LEAST = -12.0
"""No frame is worth more than this, in powers of e."""


@dataclass(frozen=True)
class _Step:
    """A frame: the step to it, its likelihoods (P,), and the belief after it (R, P)."""

    seconds: float
    turn: NDArray[np.complex128]
    exchange: float
    kept: float
    likelihood: NDArray[np.float64]
    belief: NDArray[np.float64]


class PhaseClock:
    """
    A grid filter over phase and rate (a hidden Markov model, forward and backward).

    From the front one frame says next to nothing about the phase, and the path, which goes where
    the scores are best, stalls and jumps.  A walk is even, however: with the rate as a part of the
    state, little evidence adds up over seconds.  The phase advances by rate x time; turning by
    fractions of a bin is exact in the frequency domain.
    """

    def __init__(self, phases: int, slowest: float, fastest: float, frames: int) -> None:
        """
        Lay out the grid.

        :param phases: P, phases of a stride.
        :param slowest: strides per second, slowest walk; standing is always possible.
        :param fastest: strides per second, fastest walk.
        :param frames: how many frames back the belief may be asked for, 1 = the newest only.
        """
        self._phases = phases
        walking = np.geomspace(max(slowest, 0.1 * fastest), fastest, _RATES - 1)
        self._rates = np.concatenate([[0.0], walking])
        prior = np.exp(-0.5 * (np.log(walking / _USUAL_RATE) / _SPREAD) ** 2)
        prior = np.concatenate([[_STANDING], (1 - _STANDING) * prior / prior.sum()])
        self._prior = np.repeat(prior[:, None], phases, axis=1) / phases
        self._waves = 2 * np.pi * np.arange(phases // 2 + 1)
        self._spacing = float(np.log(walking[1] / walking[0]))
        self._steps: deque[_Step] = deque(maxlen=frames)

    def reset(self) -> None:
        """Forget all frames."""
        self._steps.clear()

    def update(self, evidence: NDArray[np.float64], seconds: float) -> None:
        """
        Take in a frame.

        :param evidence: (P,) how well each phase fits, up to a constant; see ``phase_evidence``.
        :param seconds: its time, later than the last frame's.
        """
        passed = seconds - self._steps[-1].seconds if self._steps else 0.0
        spread = np.exp(-0.5 * (self._waves * _DIFFUSION) ** 2 * passed)
        turn = np.exp(-1j * np.outer(self._rates * passed, self._waves)) * spread
        exchange = min(0.3, 0.5 * _WANDER**2 * passed / self._spacing**2)
        kept = float(np.exp(-_RENEWAL * passed))
        belief = self._prior
        if self._steps:
            belief = self._turned(self._exchanged(self._steps[-1].belief, exchange), turn)
            belief = kept * belief + (1 - kept) * self._prior
        likelihood = np.exp(np.maximum((evidence - evidence.max()) / _NOISE, _LEAST))
        belief = belief * likelihood
        belief /= belief.sum()
        self._steps.append(_Step(seconds, turn, exchange, kept, likelihood, belief))

    @property
    def rate(self) -> float:
        """Return the expected rate in strides per second, 0 before the first frame."""
        if not self._steps:
            return 0.0
        return float(self._steps[-1].belief.sum(axis=1) @ self._rates)

    def beliefs(self, frames: int) -> NDArray[np.float64]:
        """
        Return the probabilities of the phases in the last frames, given all frames so far.

        :param frames: how many, at most as many as are kept.
        :returns: (frames, P), the newest last.
        """
        steps = list(self._steps)[-frames:]
        result = np.empty((len(steps), self._phases))
        later = np.ones_like(self._prior)
        for index in range(len(steps) - 1, -1, -1):
            belief = (steps[index].belief * later).sum(axis=0)
            result[index] = belief / belief.sum()
            step = steps[index]
            seen = later * step.likelihood
            back = self._exchanged(self._turned(seen, step.turn.conj()), step.exchange)
            later = step.kept * back + (1 - step.kept) * float((self._prior * seen).sum())
            later /= later.max()
        return result

    def _turned(self, belief: NDArray[np.float64], turn: NDArray[np.complex128]) -> NDArray:
        """Move the phases of each rate on."""
        moved = np.fft.irfft(np.fft.rfft(belief, axis=1) * turn, self._phases, axis=1)
        # Turning a sharp peak by a fraction of a bin rings below 0.
        return np.maximum(moved, 0.0)

    @staticmethod
    def _exchanged(belief: NDArray[np.float64], share: float) -> NDArray[np.float64]:
        """Let neighbouring walking rates exchange a share; its own adjoint."""
        walking = belief[1:]
        flow = share * np.diff(walking, axis=0)
        result = belief.copy()
        result[1:-1] += flow
        result[2:] -= flow
        return result
