# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates as lists of changes against their parents, added up by the vector unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['EventProgram', 'make_program', 'minimum_arborescence']

_MOST = 255
"""What the events of a group change a sum by at most, which 8 bits can hold."""

_MOST_OF_STEP = 32767 // _MOST
"""Groups that a step has at most: what 16 bits can add up."""

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
    Group g has the events from ``groups[g]`` to ``groups[g + 1]``, (G + 1,) int32, all added or
    all subtracted, whose spans are at most 255 together.
    A step (``target``, ``base``, both (T,) int32) makes row ``target`` from row ``base``; row 0
    is the empty template, the others are in the order in which they are made, so that results are
    written one after the other: that of template k is ``row[k] + 1``, (K,) int32.  ``bounds``
    (T, 3) int32 are the groups at which its additions begin, its subtractions begin, and these
    end.
    """

    pixels: NDArray[np.int64]
    source: NDArray[np.uint16] | NDArray[np.uint32]
    lo: NDArray[np.uint8]
    span: NDArray[np.uint8]
    groups: NDArray[np.int32]
    target: NDArray[np.int32]
    base: NDArray[np.int32]
    bounds: NDArray[np.int32]
    row: NDArray[np.int32]

    @property
    def nbytes(self) -> int:
        """Return the memory the program takes, in bytes."""
        arrays = (self.source, self.lo, self.span, self.groups)
        return self.pixels.nbytes + sum(array.nbytes for array in arrays) + 5 * self.target.nbytes


def make_program(templates: NDArray[np.uint8]) -> EventProgram:
    """
    Code templates as changes against their parents.

    :param templates: (K, height, width) uint8.
    """
    pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
    # Pixels that are in no template part none, and are more than half.
    used = np.flatnonzero(pixels.any(axis=0))
    pixels = np.ascontiguousarray(pixels[:, used])
    order, parents = minimum_arborescence(pixels)
    row = np.argsort(order).astype(np.int32)
    empty = np.zeros(len(used), np.uint8)
    events: list[tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint8]]] = []
    groups: list[NDArray[np.int32]] = [np.zeros(1, np.int32)]
    steps: list[tuple[int, int, int, int, int]] = []
    end = count = 0
    for child in order.tolist():
        parent = parents[child]
        before, after = pixels[parent] if parent >= 0 else empty, pixels[child]
        start, middle = end, end
        for low, high in ((before, after), (after, before)):
            where = np.flatnonzero(high > low)
            span = high[where] - low[where]
            place, ends = grouped(span)
            events.append((where[place], low[where[place]], span[place]))
            groups.append(ends + np.int32(count))
            count += len(where)
            middle, end = end, end + len(ends)
        target, base = int(row[child]) + 1, int(row[parent]) + 1 if parent >= 0 else 0
        # A template that is its parent, too, has a step.
        for first in range(start, max(end, start + 1), _MOST_OF_STEP):
            last = min(first + _MOST_OF_STEP, end)
            steps.append((target, base, first, min(max(middle, first), last), last))
            base = target
    source, lo, span = (np.concatenate(each) for each in zip(*events, strict=True))
    table = np.array(steps, np.int32)
    return EventProgram(
        pixels=used,
        source=source.astype(np.uint16 if len(used) <= 2**16 else np.uint32),
        lo=lo,
        span=span,
        groups=np.concatenate(groups),
        target=table[:, 0].copy(),
        base=table[:, 1].copy(),
        bounds=table[:, 2:].copy(),
        row=row,
    )


@kernel('u1[::1]')
def grouped(span):  # type: ignore[no-untyped-def]
    """
    Put events into groups whose spans are at most 255 together, nearly as few as can be.

    :param span: (E,) uint8, above 0.
    :returns: the order of the events, (E,) int64, and where in it each group ends, (G,) int32.
    """
    ascending = np.argsort(span, kind='mergesort')
    # Those of span s are from first[s] on in this order; those before rest[s] are left.
    count = np.zeros(_MOST + 2, np.int64)
    for each in span:
        count[np.int64(each) + 1] += 1
    first = np.cumsum(count)
    rest = first[1:].copy()
    order, ends = np.empty(len(span), np.int64), np.empty(len(span), np.int32)
    taken = groups = 0
    while taken < len(span):
        # Always the largest for which there is room.
        room = wanted = _MOST
        while wanted > 0:
            if rest[wanted] > first[wanted]:
                rest[wanted] -= 1
                order[taken] = ascending[rest[wanted]]
                taken += 1
                room -= wanted
            else:
                wanted -= 1
            wanted = min(wanted, room)
        ends[groups] = taken
        groups += 1
    return order, ends[:groups]


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
