# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The phase of the stride and its rate, as a probability that a steady walk carries along.

View, height and row of the body are not known well enough to tell phases apart from the front;
they are found together with the phase.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

_RATES = 14  # rates of the grid, the first of which is standing
# Strides per second of adults, 110 steps/min, and the standard deviation of its logarithm.
_USUAL_RATE, _SPREAD = 0.92, 0.2
_STANDING = 0.05  # share of people who stand
_RATE_DIFFUSION = 0.1  # standard deviation by which the logarithm of the rate changes in a second
# Least distance of the logarithms of neighbouring rates; the usual one is 0.08.
_LEAST_SPACING = 1e-6
# Share of the belief that returns to the prior in a second: people stop, or the view is wrong.
_RENEWAL = 0.02
# Evidence that is worth a factor of e.  Flipped pixels alone would give about 8; errors of real
# likelihoods are alike in neighbouring pixels.
_NOISE = 12.0
# Share of the belief in a view, height or row that goes to each neighbour in a second.
_CELL_DIFFUSION = 2.0
_UNLIKELY = 3e-3  # views and placements less likely than this are not compared
# Share of the belief that is spread over all views and placements when the views are moved.
_ANYWHERE = 0.01
# Time after which frames tell nothing more of an earlier one, as synthetic walkers show.
_LATER_S = 0.5
_FLOOR = float(np.exp(-12.0))  # no frame is worth more than this


@dataclass(frozen=True)
class _Step:
    """A frame: the step to it, its likelihoods (*cells, P), and the belief then (*cells, R, P)."""

    seconds: float
    passed: float
    moved: int
    likelihood: NDArray[np.float64]
    belief: NDArray[np.float64]


class PhaseFilter:
    """
    A grid filter over phase, rate, view and placement (hidden Markov model, forward and backward).

    From the front one frame says next to nothing about the phase, and the path, which goes where
    the scores are best, stalls and jumps.  A walk is even, however: with the rate as a part of the
    state, little evidence adds up over seconds.  The phase advances by rate x time; turning by
    fractions of a bin is exact in the frequency domain.  View and placement nearly stay.
    """

    def __init__(
        self,
        phases: int,
        slowest: float,
        fastest: float,
        frames: int,
        cells: NDArray[np.float64],
    ) -> None:
        """
        Lay out the grid.

        :param phases: P, phases of a stride.
        :param slowest: strides per second, slowest walk; standing is always possible.
        :param fastest: strides per second, fastest walk.
        :param frames: how many frames back the belief may be asked for, 1 = the newest only.
        :param cells: (views, heights, rows) float64, how likely they are at first; they need not
            add up to 1.
        """
        walking = np.geomspace(max(slowest, 0.1 * fastest), fastest, _RATES - 1)
        self._rates = np.concatenate([[0.0], walking])
        prior = np.exp(-0.5 * (np.log(walking / _USUAL_RATE) / _SPREAD) ** 2)
        prior = np.concatenate([[_STANDING], (1 - _STANDING) * prior / prior.sum()])
        self._prior = np.repeat(prior[:, None], phases, axis=1) / phases
        self._cells = cells / cells.sum()
        self._waves = 2 * np.pi * np.arange(phases // 2 + 1)
        # Not zero where the slowest and the fastest walk are as good as one.
        self._spacing = max(float(np.log(walking[1] / walking[0])), _LEAST_SPACING)
        self._steps: deque[_Step] = deque(maxlen=frames)

    def predict(self, seconds: float, moved: int = 0) -> NDArray[np.bool_]:
        """
        Predict the next frame, and return which views and placements are to be compared.

        :param seconds: its time, later than the last frame's.
        :param moved: by how many views the first axis of the cells goes on since the last frame,
            because the person turns.
        :returns: (*cells) bool.
        """
        if not self._steps:
            self._next = seconds, 0.0, moved
            return self._cells > 0
        last = self._steps[-1]
        passed = seconds - last.seconds
        self._next = seconds, passed, moved
        self._before = diffused(_moved(last.belief, moved), passed)
        share = self._before.sum(axis=(-2, -1))
        return np.asarray(share > _UNLIKELY * share.sum())

    def correct(self, evidence: NDArray[np.float64]) -> None:
        """
        Correct the belief by the frame that was predicted.

        :param evidence: (*cells, P) float64, how well each phase fits, up to a constant, -inf
            where that is not known: see ``FineEvidence``.
        """
        evidence = evidence.reshape(*self._cells.shape, -1)
        likelihood = np.exp((evidence - evidence.max()) / _NOISE)
        # No phase of a view that was compared is ruled out by one frame; of others nothing is
        # left.
        likelihood = np.where(np.isfinite(evidence), np.maximum(likelihood, _FLOOR), 0.0)
        if self._steps:
            turn, share, kept = self._transition(self._next[1])
            belief = np.zeros(self._before.shape)
            compared = likelihood.any(axis=-1)
            before = self._before[compared]
            predicted = np.empty_like(before)
            exchange(before, share, 1, predicted)
            predicted = _turned(predicted, turn)
            restarted = (1 - kept) * predicted.sum(axis=(1, 2), keepdims=True)
            predicted = kept * predicted + restarted * self._prior
            belief[compared] = predicted * likelihood[compared][:, None]
        else:
            belief = self._cells[..., None, None] * self._prior * likelihood[..., None, :]
        belief /= belief.sum()
        self._steps.append(_Step(*self._next, likelihood, belief))

    @property
    def rate(self) -> float:
        """Return the expected rate in strides per second, 0 before the first frame."""
        if not self._steps:
            return 0.0
        belief = self._steps[-1].belief.reshape(-1, *self._prior.shape)
        return float(belief.sum(axis=(0, 2)) @ self._rates)

    def belief(self, back: int = 0) -> NDArray[np.float64]:
        """
        Return the probabilities of the phases in a frame, (P,) float64, from later ones as well.

        What comes more than half a second later tells nothing more of it.

        :param back: 0 = the newest frame, 1 = the one before.
        """
        first, *others = list(self._steps)[-1 - back :]
        later: NDArray[np.float64] | float = 1.0
        for step in reversed(others):
            if step.seconds <= first.seconds + _LATER_S:
                later = self._back(step, later)
        belief = (first.belief * later).reshape(-1, first.belief.shape[-1]).sum(axis=0)
        return np.asarray(belief / belief.sum())

    def _back(self, step: _Step, later: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Carry the likelihood of all later frames (..., R, P) to the frame before a step."""
        turn, share, kept = self._transition(step.passed)
        seen = np.broadcast_to(later * step.likelihood[..., None, :], step.belief.shape)
        # Backward it is the transpose: the exchange is its own, that of a turn its conjugate.
        turned = _turned(seen, turn.conj())
        back, shape = np.empty_like(turned), (-1, *turned.shape[-2:])
        exchange(turned.reshape(shape), share, 1, back.reshape(shape))
        renewed = (self._prior * seen).sum(axis=(-2, -1), keepdims=True)
        back = kept * back + (1 - kept) * renewed
        back = _moved(diffused(back, step.passed), -step.moved)
        return np.asarray(back / back.max())

    def _transition(self, passed: float) -> tuple[NDArray[np.complex128], float, float]:
        """Return the turns of the rates (R, P / 2 + 1), share exchanged, and share not renewed."""
        turn = np.exp(-1j * np.outer(self._rates * passed, self._waves))
        share = min(0.3, 0.5 * _RATE_DIFFUSION**2 * passed / self._spacing**2)
        return np.asarray(turn), share, math.exp(-_RENEWAL * passed)


@kernel('f8[:,:,::1], f8, i8, f8[:,:,::1]')
def exchange(before, share, first, after):  # type: ignore[no-untyped-def]
    """
    Let neighbours along the middle axis exchange a share of their difference; its own adjoint.

    :param before: float64, and ``after`` likewise, written.
    :param first: from which one on.
    """
    count = before.shape[1]
    for outer in range(len(before)):
        for place in range(count):
            old, new = before[outer, place], after[outer, place]
            new[:] = old
            if first <= place < count - 1:
                following = before[outer, place + 1]
                for j in range(len(old)):
                    new[j] += share * (following[j] - old[j])
            if place > first:
                last = before[outer, place - 1]
                for j in range(len(old)):
                    new[j] -= share * (old[j] - last[j])


@kernel('f8[:,:,:,:,::1], f8')
def diffused(belief, seconds):  # type: ignore[no-untyped-def]
    """Let neighbouring views, heights and rows, the first axes, exchange a share, in a copy."""
    share = min(0.3, _CELL_DIFFUSION * seconds)
    one, other = np.empty_like(belief), np.empty_like(belief)
    views, heights, rows, rates, phases = belief.shape
    rest = rates * phases
    shape = 1, views, heights * rows * rest
    exchange(belief.reshape(shape), share, 0, one.reshape(shape))
    shape = views, heights, rows * rest
    exchange(one.reshape(shape), share, 0, other.reshape(shape))
    shape = views * heights, rows, rest
    exchange(other.reshape(shape), share, 0, one.reshape(shape))
    return one


def _turned(belief: NDArray[np.float64], turn: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Move the phases of each rate, (..., R, P), on by a spectrum."""
    result = np.fft.irfft(np.fft.rfft(belief) * turn, belief.shape[-1])
    # A sharp peak turned by a fraction of a bin rings below 0.
    return np.asarray(np.maximum(result, 0.0))


def _moved(belief: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """Take a belief to views that lie ``steps`` farther on; new views get what all have."""
    if steps == 0:
        return belief
    views = len(belief)
    everywhere = belief.mean(axis=(0, 1, 2), keepdims=True)
    result = np.zeros_like(belief)
    if abs(steps) < views:
        low, high = max(0, -steps), min(views, views - steps)
        result[low:high] = belief[low + steps : high + steps]
    return (1 - _ANYWHERE) * result + _ANYWHERE * everywhere
