# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Steps of a belief over views, body heights, rows, rates and phases.

The phases are treated in blocks of a fixed number, which the vector unit needs: a stride has too
few for loops of any length to be worth its while.
"""

from __future__ import annotations

import numpy as np

from gait_segmentation.kernels import kernel

__all__ = ['advance', 'carry', 'diffuse']

_BLOCK = 16


@kernel('f8[:,:,:,::1], f8', fastmath=True)
def diffuse(belief, share):  # type: ignore[no-untyped-def]
    """
    Let neighbouring views, heights and rows exchange a share, in place; its own adjoint.

    :param belief: (V, S, Y, N) float64.
    :param share: of the difference of two neighbours that goes from one to the other, below 0.5.
    """
    views, heights, rows, size = belief.shape
    along = belief.reshape(1, views, heights * rows * size)
    _exchange(along, share)
    _exchange(belief.reshape(views, heights, rows * size), share)
    _exchange(belief.reshape(views * heights, rows, size), share)


@kernel(fastmath=True)
def _exchange(belief, share):  # type: ignore[no-untyped-def]
    """Let neighbours along the middle axis exchange a share."""
    others, count, size = belief.shape
    flow = np.empty(size)
    for other in range(others):
        flow[:] = 0.0
        for k in range(count - 1):
            here, there = belief[other, k], belief[other, k + 1]
            for j in range(size):
                out = share * (there[j] - here[j])
                here[j] += out - flow[j]
                flow[j] = out
        last = belief[other, count - 1]
        for j in range(size):
            last[j] -= flow[j]


@kernel(fastmath=True)
def carry(belief, turn, exchange, result):  # type: ignore[no-untyped-def]
    """
    Let neighbouring rates exchange a share, and move the phases of each rate on.

    :param belief: (N, R, P) float64, the first rate is standing, which exchanges nothing.
    :param turn: (R, P) float64, how likely each advance of the phase is.
    :param exchange: share that goes to each neighbouring rate.
    :param result: (N, R, P) float64, written.
    """
    row, out = _buffers(belief.shape[2])
    for cell in range(len(belief)):
        _carry_cell(belief[cell], turn, exchange, row, out, result[cell])


@kernel('f8[:,:,::1], f8[:,::1], f8, f8, f8[:,::1], f8[:,::1], f8[:,:,::1]', fastmath=True)
def advance(belief, turn, exchange, kept, prior, likelihood, result):  # type: ignore[no-untyped-def]
    """
    Put the belief a frame later into ``result``.

    :param belief: (N, R, P) float64, not negative.
    :param turn: see :func:`carry`.
    :param kept: share that does not begin anew with ``prior``, (R, P) float64.
    :param likelihood: (N, P) float64 of the frame; where it is 0 nothing is left.
    :param result: (N, R, P) float64, written; adds up to 1.
    """
    cells, rates, phases = belief.shape
    row, out = _buffers(phases)
    everything = 0.0
    for cell in range(cells):
        seen, target = likelihood[cell], result[cell]
        if _nothing(seen) or _nothing(belief[cell].reshape(-1)):
            target[:] = 0.0
            continue
        _carry_cell(belief[cell], turn, exchange, row, out, target)
        anew = (1.0 - kept) * target.sum()
        for rate in range(rates):
            for phase in range(phases):
                value = kept * target[rate, phase] + anew * prior[rate, phase]
                value *= seen[phase]
                target[rate, phase] = value
                everything += value
    for cell in range(cells):
        for rate in range(rates):
            for phase in range(phases):
                result[cell, rate, phase] /= everything


@kernel()
def _nothing(values):  # type: ignore[no-untyped-def]
    """Tell whether no value is above 0."""
    largest = 0.0
    for k in range(len(values)):
        largest = max(largest, values[k])
    return largest <= 0.0


@kernel()
def _buffers(phases):  # type: ignore[no-untyped-def]
    """Return room for a row of phases twice, and for the sums of one, in whole blocks."""
    whole = (phases + _BLOCK - 1) // _BLOCK * _BLOCK
    return np.zeros(phases + whole), np.zeros(whole)


@kernel(fastmath=True)
def _carry_cell(belief, turn, exchange, row, out, result):  # type: ignore[no-untyped-def]
    """Do what :func:`carry` does with one (R, P) belief."""
    rates, phases = belief.shape
    for rate in range(rates):
        low, high = max(rate - 1, min(rate, 1)), min(rate + 1, rates - 1) if rate else 0
        for phase in range(phases):
            here = belief[rate, phase]
            value = here + exchange * (belief[low, phase] + belief[high, phase] - 2.0 * here)
            row[phase] = value
            row[phase + phases] = value
        out[:] = 0.0
        for step in range(phases):
            share, start = turn[rate, step], phases - step
            for first in range(0, len(out), _BLOCK):
                for k in range(_BLOCK):
                    out[first + k] += share * row[start + first + k]
        for phase in range(phases):
            # A sharp peak turned by a fraction of a bin rings below 0.
            result[rate, phase] = max(out[phase], 0.0)
