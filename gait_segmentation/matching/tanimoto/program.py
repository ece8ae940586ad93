# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates as lists of changes against their parents, arranged for the vector unit."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.arborescence import minimum_arborescence

__all__ = ['GROUP', 'EventProgram', 'make_program']

GROUP = 4
"""Events a group holds; groups that are not full are filled with events that add nothing."""

_NARROW_LIMIT = 255
"""Most that the events of a narrow group may add together: what 8 bits hold."""

_SUM_LIMIT = 32767 - GROUP // 2 * 255
"""Most that the groups of one sign in one step may add together: what 16 bits hold, less the
half of a mixed group."""

_OPEN_GROUPS = 8


@dataclass(frozen=True)
class EventProgram:
    """
    All templates of a bank, coded as changes.

    An *event* is a pixel in which a template differs from its parent, a there and b here.  It
    changes the common area by min(v, b) - min(v, a), which is min(max(v - lo, 0), span) with
    lo = min(a, b) and span = |b - a|, added if b > a and subtracted if not.

    ``pixels`` (A,) int64 are the pixels any event uses.  ``source`` (E,) int32 is an event's
    place in that list, ``lo`` and ``span`` (E,) uint8.  Every ``GROUP`` events are a group;
    the sum of a *narrow* group fits 8 bits.  A step (``target``, ``base``, both (T,) int32)
    makes row ``target`` from row ``base``; row 0 is the empty template, row k + 1 template k.
    ``bounds`` (T, 6) int32 are the group numbers between its narrow additions, wide additions,
    narrow subtractions, wide subtractions and mixed groups, whose first half is added and second
    half subtracted.  ``events`` counts the events without filling.
    """

    pixels: NDArray[np.int64]
    source: NDArray[np.int32]
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

    The standard bank takes seconds, so the last programs are kept; nobody may write to them.

    :param templates: (K, height, width) uint8.
    """
    return _make_program(_ByContent(templates))


@lru_cache(maxsize=12)
def _make_program(key: _ByContent) -> EventProgram:
    templates = key.templates
    pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
    order, parents = minimum_arborescence(pixels)
    empty = np.zeros(pixels.shape[1], np.uint8)
    builder = _Builder()
    for child in order:
        parent = int(parents[child])
        before = empty if parent < 0 else pixels[parent]
        builder.template(int(child) + 1, parent + 1, before, pixels[child])
    return builder.done()


def _narrow_groups(span: NDArray[np.uint8]) -> tuple[list[list[int]], list[int]]:
    """Sort events into narrow groups by first fit; return these and the rest."""
    narrow: list[list[int]] = []
    lonely: list[int] = []
    opened: list[tuple[list[int], int]] = []

    def close(group: list[int]) -> None:
        if len(group) > GROUP // 2:
            narrow.append(group)
        else:
            lonely.extend(group)

    for event, size in enumerate(span.tolist()):
        for place, (group, total) in enumerate(opened):
            if total + size <= _NARROW_LIMIT:
                group.append(event)
                opened[place] = (group, total + size)
                if len(group) == GROUP:
                    close(opened.pop(place)[0])
                break
        else:
            if len(opened) == _OPEN_GROUPS:
                close(opened.pop(0)[0])
            opened.append(([event], size))
    for group, _ in opened:
        close(group)
    return narrow, sorted(lonely)


class _Builder:
    """Collects the events of all templates."""

    def __init__(self) -> None:
        self._source: list[NDArray[np.int64]] = []
        self._lo: list[NDArray[np.uint8]] = []
        self._span: list[NDArray[np.uint8]] = []
        self._places = 0
        self._events = 0
        self._steps: list[tuple[int, int, list[int]]] = []

    def template(
        self, target: int, base: int, before: NDArray[np.uint8], after: NDArray[np.uint8]
    ) -> None:
        """Add the events that make one template from its parent."""
        where = np.flatnonzero(before != after)
        self._events += len(where)
        old, new = before[where], after[where]
        lo = np.minimum(old, new)
        span = np.maximum(old, new) - lo
        kinds: list[list[list[int]]] = []
        rests: list[list[int]] = []
        for chosen in (np.flatnonzero(new > old), np.flatnonzero(new < old)):
            narrow, lonely = _narrow_groups(span[chosen])
            wide = [lonely[i : i + GROUP] for i in range(0, len(lonely), GROUP)]
            rests.append(wide.pop() if wide and len(wide[-1]) <= GROUP // 2 else [])
            for groups in (narrow, wide):
                kinds.append([[int(chosen[event]) for event in group] for group in groups])
            rests[-1] = [int(chosen[event]) for event in rests[-1]]
        mixed: list[tuple[list[int], list[int]]] = []
        if all(rests):
            mixed = [(rests[0], rests[1])]
        elif any(rests):
            kinds[1 if rests[0] else 3].append(rests[0] or rests[1])
        while True:
            taken = self._take(kinds, span)
            filled = [[(group, GROUP) for group in groups] for groups in taken]
            halves = [(half, GROUP // 2) for pair in mixed for half in pair]
            self._step(target, base, [*filled, halves], where, lo, span)
            base, mixed = target, []
            if not any(kinds):
                return

    @staticmethod
    def _take(kinds: list[list[list[int]]], span: NDArray[np.uint8]) -> list[list[list[int]]]:
        """Take from the groups as many of either sign as 16 bits can sum up."""
        taken: list[list[list[int]]] = []
        for first in (0, 2):
            total = 0
            for kind in (first, first + 1):
                count = 0
                for group in kinds[kind]:
                    total += int(span[group].sum(dtype=np.int64))
                    if total > _SUM_LIMIT:
                        break
                    count += 1
                taken.append(kinds[kind][:count])
                kinds[kind] = kinds[kind][count:]
                if kinds[kind]:
                    total = _SUM_LIMIT
        return taken

    def _step(
        self,
        target: int,
        base: int,
        kinds: list[list[tuple[list[int], int]]],
        where: NDArray[np.int64],
        lo: NDArray[np.uint8],
        span: NDArray[np.uint8],
    ) -> None:
        bounds = [self._places // GROUP]
        for groups in kinds:
            for group, size in groups:
                filling = size - len(group)
                last = where[group[-1:]].repeat(filling)
                nothing = np.zeros(filling, np.uint8)
                self._source.append(np.concatenate([where[group], last]))
                self._lo.append(np.concatenate([lo[group], nothing]))
                self._span.append(np.concatenate([span[group], nothing]))
                self._places += size
            bounds.append(self._places // GROUP)
        self._steps.append((target, base, bounds))

    def done(self) -> EventProgram:
        """Return everything collected."""
        where = np.concatenate([*self._source, np.empty(0, np.int64)])
        pixels, source = np.unique(where, return_inverse=True)
        return EventProgram(
            pixels=pixels,
            source=source.astype(np.int32),
            lo=np.concatenate([*self._lo, np.empty(0, np.uint8)]),
            span=np.concatenate([*self._span, np.empty(0, np.uint8)]),
            target=np.array([step[0] for step in self._steps], np.int32),
            base=np.array([step[1] for step in self._steps], np.int32),
            bounds=np.array([step[2] for step in self._steps], np.int32).reshape(-1, 6),
            events=self._events,
        )
