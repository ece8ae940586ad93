# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates as lists of changes against their parents, arranged for the vector unit."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.tanimoto.arborescence import minimum_arborescence

__all__ = ['GROUP', 'PAIR', 'EventProgram', 'in_order', 'make_program']

GROUP, PAIR = 4, 2
"""Events that a narrow group holds, and any other one; groups that are not full are filled with
events that add nothing."""

_NARROW_LIMIT = 255
"""Most that the events of a narrow group may add together: what 8 bits hold."""

_SUM_LIMIT = 32767 - 255
"""Most that the groups of one sign in one step may add together: what 16 bits hold, less the
half of a mixed pair."""

_OPEN_GROUPS = 8

_KINDS = ('narrow +', 'wide +', 'narrow -', 'wide -', 'mixed')
"""Kinds of groups, in the order in which a step has them."""


@dataclass(frozen=True)
class EventProgram:
    """
    All templates of a bank, coded as changes.

    An *event* is a pixel in which a template differs from its parent, a there and b here.  It
    changes the common area by min(v, b) - min(v, a), which is min(max(v - lo, 0), span) with
    lo = min(a, b) and span = |b - a|, added if b > a and subtracted if not.

    ``pixels`` (A,) int64 are the pixels any event uses.  ``source`` (E,) uint16, or uint32 where
    there are many pixels, is an event's place in that list, ``lo`` and ``span`` (E,) are uint8.
    ``GROUP`` events are a *narrow* group,
    whose sum fits 8 bits, ``PAIR`` a wide or a mixed one.  A step (``target``, ``base``, both (T,)
    int32) makes row ``target`` from row ``base``; row 0 is the empty template, row k + 1 template
    k.  ``bounds`` (T, 6) int32 are the places, in pairs, between its narrow additions, wide
    additions, narrow subtractions, wide subtractions and mixed pairs, of which the first is added
    and the second subtracted.  ``events`` counts the events without filling.
    """

    pixels: NDArray[np.int64]
    source: NDArray[np.uint16] | NDArray[np.uint32]
    lo: NDArray[np.uint8]
    span: NDArray[np.uint8]
    target: NDArray[np.int32]
    base: NDArray[np.int32]
    bounds: NDArray[np.int32]
    events: int

    @property
    def nbytes(self) -> int:
        """Return the memory the program takes, in bytes."""
        arrays = (self.source, self.lo, self.span, self.target, self.base, self.bounds)
        return self.pixels.nbytes + sum(array.nbytes for array in arrays)


class _ByContent:
    """Templates that are equal, as a key, to other templates with the same pixels."""

    def __init__(self, templates: NDArray[np.uint8]) -> None:
        self.templates = np.ascontiguousarray(templates)
        digest = hashlib.sha256(self.templates.tobytes()).digest()
        self._key = (templates.shape, digest)

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByContent) and other._key == self._key


def make_program(templates: NDArray[np.uint8]) -> EventProgram:
    """
    Code templates as changes against their parents.

    The last programs are kept, as the matchers of all slots need the same ones; nobody may write
    to them.

    :param templates: (K, height, width) uint8.
    """
    return _make_program(_ByContent(templates))


@lru_cache(maxsize=12)
def _make_program(key: _ByContent) -> EventProgram:
    templates = key.templates
    pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
    # Pixels that are in no template part none, and are more than half.
    order, parents = minimum_arborescence(np.ascontiguousarray(pixels[:, pixels.any(axis=0)]))
    events, spans = _count(pixels, order, parents)
    # Narrow groups are filled up by at most one event, and one wide one in each step and sign.
    places = 2 * events + 2 * PAIR * (len(pixels) + 1)
    steps = len(pixels) + 2 * (spans // (_SUM_LIMIT - 2 * GROUP * 255) + len(pixels))
    where = np.empty(places, np.int64)
    lo = np.empty(places, np.uint8)
    span = np.empty(places, np.uint8)
    rows = np.empty((steps, 2), np.int32)
    bounds = np.empty((steps, len(_KINDS) + 1), np.int32)
    places, steps = _code(pixels, order, parents, where, lo, span, rows, bounds)
    used = np.flatnonzero(np.bincount(where[:places], minlength=pixels.shape[1]))
    place = np.zeros(pixels.shape[1], np.uint16 if len(used) <= 2**16 else np.uint32)
    place[used] = np.arange(len(used))
    return EventProgram(
        pixels=used,
        source=place[where[:places]],
        lo=lo[:places].copy(),
        span=span[:places].copy(),
        target=rows[:steps, 0].copy(),
        base=rows[:steps, 1].copy(),
        bounds=bounds[:steps].copy(),
        events=events,
    )


def in_order(program: EventProgram) -> tuple[EventProgram, NDArray[np.int32]]:
    """
    Number the rows in the order in which they are made.

    Results are then written one after the other, which caches and their prefetchers are made for.

    :returns: the program, and the place that each template's row has now, (K,) int32 from 0.
    """
    made, first = np.unique(program.target, return_index=True)
    place = np.empty(len(made), np.int32)
    place[np.argsort(first)] = np.arange(len(made))
    row = np.concatenate([[0], place + 1]).astype(np.int32)
    return replace(program, target=row[program.target], base=row[program.base]), place


@kernel('u1[:,::1], i8[::1], i8[::1]')
def _count(pixels, order, parents):  # type: ignore[no-untyped-def]
    """Return the number of events and the sum of their spans."""
    events, spans = 0, 0
    for child in order:
        for x in range(pixels.shape[1]):
            before = np.int64(0)
            if parents[child] >= 0:
                before = np.int64(pixels[parents[child], x])
            change = abs(np.int64(pixels[child, x]) - before)
            events += change != 0
            spans += change
    return events, spans


@kernel('u1[:,::1], i8[::1], i8[::1], i8[::1], u1[::1], u1[::1], i4[:,::1], i4[:,::1]')
def _code(pixels, order, parents, where, lo, span, rows, bounds):  # type: ignore[no-untyped-def]
    """
    Write the program; the other arguments are as in :class:`EventProgram`, with room to spare.

    :param where: the events' pixels.
    :param rows: targets and bases.
    :returns: number of places and steps written.
    """
    size = pixels.shape[1]
    event_lo, event_span = np.empty((2, size), np.uint8), np.empty((2, size), np.uint8)
    event_where = np.empty((2, size), np.int64)
    # For either sign the groups, narrow ones first, as numbers of events, -1 = filling.
    groups = np.empty((2, size + 2, GROUP), np.int64)
    lonely = np.empty(size, np.int64)
    rests = np.empty(2, np.int64)
    narrow, total, taken = np.empty(2, np.int64), np.empty(2, np.int64), np.empty(2, np.int64)
    out = where, lo, span
    place, step = 0, 0
    for child in order:
        parent = parents[child]
        count = np.zeros(2, np.int64)
        for x in range(size):
            before = pixels[parent, x] if parent >= 0 else np.uint8(0)
            after = pixels[child, x]
            if after != before:
                sign = 0 if after > before else 1
                event_where[sign, count[sign]] = x
                event_lo[sign, count[sign]] = min(before, after)
                event_span[sign, count[sign]] = max(before, after) - min(before, after)
                count[sign] += 1
        rests[:] = -1
        for sign in range(2):
            narrow[sign], alone = _narrow_groups(
                event_span[sign, : count[sign]], groups[sign], lonely
            )
            total[sign] = narrow[sign] + alone // PAIR
            groups[sign, narrow[sign] : total[sign] + 1] = -1
            for k in range(alone // PAIR * PAIR):
                groups[sign, narrow[sign] + k // PAIR, k % PAIR] = lonely[k]
            if alone % PAIR:
                rests[sign] = lonely[alone - 1]
        mixed = rests[0] >= 0 and rests[1] >= 0
        for sign in range(2):
            if not mixed and rests[sign] >= 0:
                groups[sign, total[sign], 0] = rests[sign]
                total[sign] += 1
        taken[:] = 0
        base = parent + 1
        while True:
            rows[step, 0], rows[step, 1] = child + 1, base
            bounds[step, 0] = place // PAIR
            for sign in range(2):
                events = event_where[sign], event_lo[sign], event_span[sign]
                first = taken[sign]
                taken[sign] = _fitting(event_span[sign], groups[sign], first, total[sign])
                middle = min(max(first, narrow[sign]), taken[sign])
                for group in range(first, middle):
                    place = _write(groups[sign, group], events, out, place)
                bounds[step, 2 * sign + 1] = place // PAIR
                for group in range(middle, taken[sign]):
                    place = _write(groups[sign, group, :PAIR], events, out, place)
                bounds[step, 2 * sign + 2] = place // PAIR
            if mixed:
                for sign in range(2):
                    events = event_where[sign], event_lo[sign], event_span[sign]
                    place = _write(rests[sign : sign + 1], events, out, place)
                mixed = False
            bounds[step, 5] = place // PAIR
            step += 1
            base = child + 1
            if taken[0] == total[0] and taken[1] == total[1]:
                break
    return place, step


@kernel()
def _narrow_groups(span, groups, lonely):  # type: ignore[no-untyped-def]
    """
    Sort events into narrow groups by first fit.

    :param groups: (n, GROUP) int64, result, -1 = filling.
    :param lonely: (n,) int64, result, the rest in order.
    :returns: number of groups and of the rest.
    """
    members = np.empty((_OPEN_GROUPS, GROUP), np.int64)
    held = np.zeros(_OPEN_GROUPS, np.int64)
    total = np.zeros(_OPEN_GROUPS, np.int64)
    opened, found, alone = 0, 0, 0
    for event in range(len(span) + _OPEN_GROUPS):
        done = -1
        if event < len(span):
            fits = -1
            for k in range(opened):
                if total[k] + span[event] <= _NARROW_LIMIT:
                    fits = k
                    break
            if fits < 0 and opened == _OPEN_GROUPS:
                done = 0
            elif fits >= 0:
                members[fits, held[fits]] = event
                held[fits] += 1
                total[fits] += span[event]
                if held[fits] == GROUP:
                    done = fits
        elif opened > 0:
            fits, done = 0, 0
        else:
            break
        if done >= 0:
            if held[done] > GROUP // 2:
                for k in range(GROUP):
                    groups[found, k] = members[done, k] if k < held[done] else -1
                found += 1
            else:
                for k in range(held[done]):
                    # In order.
                    place = alone
                    while place > 0 and lonely[place - 1] > members[done, k]:
                        lonely[place] = lonely[place - 1]
                        place -= 1
                    lonely[place] = members[done, k]
                    alone += 1
            opened -= 1
            for k in range(done, opened):
                held[k], total[k] = held[k + 1], total[k + 1]
                for each in range(GROUP):
                    members[k, each] = members[k + 1, each]
        if fits < 0:
            members[opened, 0] = event
            held[opened], total[opened] = 1, span[event]
            opened += 1
    return found, alone


@kernel()
def _fitting(span, groups, first, last):  # type: ignore[no-untyped-def]
    """Return up to which group from the first on 16 bits can sum up."""
    total = 0
    for group in range(first, last):
        for event in groups[group]:
            if event >= 0:
                total += span[event]
        if total > _SUM_LIMIT:
            return group
    return last


@kernel()
def _write(group, events, out, place):  # type: ignore[no-untyped-def]
    """Write a group, filled up with events that add nothing; return the next place."""
    event_where, event_lo, event_span = events
    where, lo, span = out
    last = 0
    for event in group:
        if event >= 0:
            last = event_where[event]
        where[place] = last
        lo[place] = event_lo[event] if event >= 0 else 0
        span[place] = event_span[event] if event >= 0 else 0
        place += 1
    return place
