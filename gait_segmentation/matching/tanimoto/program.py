# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates as lists of changes against their parents, added up by the vector unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['PAIR', 'EventProgram', 'make_program', 'minimum_arborescence']

PAIR = 2
"""Events that are added at once; an odd number of one sign is filled up with one that adds 0."""

_MOST_OF_STEP = 32767 // 255 // PAIR
"""Pairs that a step has at most: what 16 bits can add up."""

_RUN = 512
"""Pixels that are compared before it is looked whether they are enough."""


@dataclass(frozen=True)
class EventProgram:
    """
    All templates of a bank, coded as changes.

    An *event* is a pixel in which a template differs from its parent, a there and b here.  It
    changes the common area by min(v, b) - min(v, a), which is min(max(v - lo, 0), span) with
    lo = min(a, b) and span = |b - a|, added if b > a and subtracted if not.

    ``pixels`` (A,) int64 are the pixels any event uses.  ``source`` (E,) uint16, or uint32 where
    there are many pixels, is an event's place in that list, ``lo`` and ``span`` (E,) are uint8.
    A step (``target``, ``base``, both (T,) int32) makes row ``target`` from row ``base``; row 0
    is the empty template, the others are in the order in which they are made, so that results are
    written one after the other: that of template k is ``row[k] + 1``, (K,) int32.  ``bounds``
    (T, 3) int32 are the places, in pairs, where its additions begin, its subtractions begin, and
    these end.  ``events`` counts the events without filling.
    """

    pixels: NDArray[np.int64]
    source: NDArray[np.uint16] | NDArray[np.uint32]
    lo: NDArray[np.uint8]
    span: NDArray[np.uint8]
    target: NDArray[np.int32]
    base: NDArray[np.int32]
    bounds: NDArray[np.int32]
    row: NDArray[np.int32]
    events: int

    @property
    def nbytes(self) -> int:
        """Return the memory the program takes, in bytes."""
        arrays = (self.source, self.lo, self.span, self.target, self.base, self.bounds)
        return self.pixels.nbytes + sum(array.nbytes for array in arrays)


def make_program(templates: NDArray[np.uint8]) -> EventProgram:
    """
    Code templates as changes against their parents.

    :param templates: (K, height, width) uint8.
    """
    pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
    # Pixels that are in no template part none, and are more than half.
    order, parents = minimum_arborescence(np.ascontiguousarray(pixels[:, pixels.any(axis=0)]))
    row = np.argsort(order).astype(np.int32)
    empty = np.zeros(pixels.shape[1], np.uint8)
    events: list[tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint8]]] = []
    steps: list[tuple[int, int, int, int, int]] = []
    end = 0
    for child in order.tolist():
        parent = parents[child]
        before, after = pixels[parent] if parent >= 0 else empty, pixels[child]
        added, taken = _events(before, after), _events(after, before)
        events += [added, taken]
        start, middle = end, end + len(added[0]) // PAIR
        end = middle + len(taken[0]) // PAIR
        target, base = int(row[child]) + 1, int(row[parent]) + 1 if parent >= 0 else 0
        # A template that is its parent, too, has a step.
        for first in range(start, max(end, start + 1), _MOST_OF_STEP):
            last = min(first + _MOST_OF_STEP, end)
            steps.append((target, base, first, min(max(middle, first), last), last))
            base = target
    where, lo, span = (np.concatenate(each) for each in zip(*events, strict=True))
    table = np.array(steps, np.int32)
    used = np.flatnonzero(np.bincount(where, minlength=pixels.shape[1]))
    place = np.zeros(pixels.shape[1], np.uint16 if len(used) <= 2**16 else np.uint32)
    place[used] = np.arange(len(used))
    return EventProgram(
        pixels=used,
        source=place[where],
        lo=lo,
        span=span,
        target=table[:, 0].copy(),
        base=table[:, 1].copy(),
        bounds=table[:, 2:].copy(),
        row=row,
        events=int(np.count_nonzero(span)),
    )


def _events(
    low: NDArray[np.uint8], high: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint8]]:
    """Return pixel, lo and span where one row is above another, filled up to pairs."""
    where = np.flatnonzero(high > low)
    span = high[where] - low[where]
    if len(where) % PAIR:
        where, span = np.append(where, where[-1]), np.append(span, np.uint8(0))
    return where, low[where], span


@kernel('u1[:,::1]')
def minimum_arborescence(pixels):  # type: ignore[no-untyped-def]
    """
    Return a minimum spanning arborescence that starts at the empty template.

    The length of an edge is the number of pixels in which its two templates differ.  Equal
    templates, such as the half-cycle twins of a profile view, are neighbours at length 0.

    :param pixels: (K, N) uint8.
    :returns: order of the templates, parents first, and the parent of each template (by
        template, -1 = the empty one), both (K,) int64.  R. C. Prim, 1957.
    """
    count, size = pixels.shape
    distance = np.empty(count, np.int64)
    parent = np.full(count, -1, np.int64)
    order = np.empty(count, np.int64)
    done = np.zeros(count, np.bool_)
    for k in range(count):
        differ = 0
        for x in range(size):
            differ += pixels[k, x] != 0
        distance[k] = differ
    for place in range(count):
        nearest = -1
        for k in range(count):
            if not done[k] and (nearest < 0 or distance[k] < distance[nearest]):
                nearest = k
        done[nearest] = True
        order[place] = nearest
        for k in range(count):
            if not done[k]:
                differ = _differ(pixels[k], pixels[nearest], distance[k])
                if differ < distance[k]:
                    distance[k] = differ
                    parent[k] = nearest
    return order, parent


@kernel()
def _differ(one, other, limit):  # type: ignore[no-untyped-def]
    """Return in how many pixels two templates differ, or any number from a limit on if so many."""
    differ = np.int64(0)
    for first in range(0, len(one), _RUN):
        part, rest = one[first : first + _RUN], other[first : first + _RUN]
        # In numbers as small as this, many are counted at a time.
        found = np.int16(0)
        for x in range(len(part)):
            found = np.int16(found + np.int16(part[x] != rest[x]))
        differ += found
        if differ >= limit:
            break
    return differ
