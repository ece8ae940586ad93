# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inner loops of the event kernel, over windows that lie side by side."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.tanimoto.program import PAIR

__all__ = ['LANES', 'RUN', 'gather', 'run_program']

LANES = 192
"""Windows that one call of :func:`run_program` treats."""

RUN = 16
"""Bytes that are copied at once."""

_WORD = 8
"""Bytes of a number by which they are."""


def gather(
    plane: NDArray[np.uint8],
    origins: NDArray[np.int64],
    places: NDArray[np.int64],
    offsets: NDArray[np.int64],
    matrix: NDArray[np.uint8],
) -> None:
    """
    Put the windows of a block side by side for all pixels, run by run.

    :param plane: flat uint8 image, its pixels ordered so that windows are contiguous.
    :param origins: (A,) int64, where in it the pixels of the first window are.
    :param places: (R,) int64 lanes at which the runs begin.
    :param offsets: (R,) int64, how far the runs' windows are from the first one.
    :param matrix: flat uint8, result, ``LANES`` bytes a pixel and a run to spare.
    """
    _gather(_words(plane), origins, places, offsets, _words(matrix))


def _words(data: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the words that begin at each byte, which share their memory."""
    return np.ndarray((data.size - _WORD + 1,), np.uint64, data.data, strides=(1,))


@kernel('u8[:], i8[::1], i8[::1], i8[::1], u8[:]')
def _gather(plane, origins, places, offsets, matrix):  # type: ignore[no-untyped-def]
    for pixel in range(len(origins)):
        origin, row = origins[pixel], pixel * LANES
        for run in range(len(places)):
            target, source = row + places[run], origin + offsets[run]
            matrix[target] = plane[source]
            matrix[target + _WORD] = plane[source + _WORD]


@njit(nogil=True, inline='always')
def _change(value, lo, span):  # type: ignore[no-untyped-def]
    """Return what an event adds; unsigned, so that as many as possible are done at once."""
    return np.int16(min(np.uint8(max(value, lo) - lo), span))


@kernel('u1[::1], u2[::1], u1[::1], u1[::1], i4[:,::1], i4[::1], i4[::1], i4[::1], i8, i8')
def run_program(  # type: ignore[no-untyped-def]
    matrix, source, lo, span, bounds, target, base, out, stride, first
):
    """
    Make the common areas of all templates for the gathered windows.

    :param matrix: flat uint8, ``LANES`` bytes for each pixel of the program.
    :param source: as the next five in :class:`EventProgram`.
    :param out: flat int32, rows of ``stride``; row 0 must be zero.
    :param first: where the windows' results begin in a row.
    """
    total = np.empty(LANES, np.int16)
    for step in range(len(target)):
        total[:] = 0
        for pair in range(bounds[step, 0], bounds[step, 2]):
            one, two = PAIR * pair, PAIR * pair + 1
            lo_one, span_one, lo_two, span_two = lo[one], span[one], lo[two], span[two]
            place = LANES * np.int64(source[one])
            values = matrix[place : place + LANES]
            place = LANES * np.int64(source[two])
            others = matrix[place : place + LANES]
            if pair < bounds[step, 1]:
                for lane in range(LANES):
                    change = _change(values[lane], lo_one, span_one)
                    total[lane] += change + _change(others[lane], lo_two, span_two)
            else:
                for lane in range(LANES):
                    change = _change(values[lane], lo_one, span_one)
                    total[lane] -= change + _change(others[lane], lo_two, span_two)
        old = out[base[step] * stride + first : base[step] * stride + first + LANES]
        new = out[target[step] * stride + first : target[step] * stride + first + LANES]
        for lane in range(LANES):
            new[lane] = old[lane] + total[lane]
