# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Maximum preflow on a graph of grid pixels, by pushing and relabelling.

Goldberg and Tarjan (J. ACM 1988) with the heuristics of Cherkassky and Goldberg (Algorithmica
1997): exact labels by breadth-first search, a queue of active nodes, and gaps.  The pixels that
are open lie in a band about an outline, a few steps from both terminals, so labels stay small and
a few passes settle everything.
"""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ['ARCS', 'FAR', 'push_flow']

ARCS = 8
"""Arcs of a node; arc ``a`` of one end is arc ``a ^ 4`` of the other."""

FAR = 1 << 30
"""Label of nodes that the sink cannot be reached from."""

_PATIENCE = 2
"""Relabellings, in nodes, after which the labels are made exact again."""


@njit(cache=True, nogil=True)
def push_flow(beside, capacity, terminal):  # type: ignore[no-untyped-def]
    """
    Push as much flow to the sink as fits.

    :param beside: (N + 1, 8) uint32 neighbours of the nodes, N where there is none; unsigned, as
        every index that may be negative costs a look.
    :param capacity: (N + 1, 8) int32 >= 0, capacity to each neighbour, 0 where there is none;
        becomes what is left of it.
    :param terminal: (N + 1,) int32, capacity from the source, or to the sink if negative, the
        last one 0; becomes what is left of it.
    :returns: (N + 1,) int32, steps to what is left of the sink's capacity, ``FAR`` where it
        cannot be reached: the source's side of a minimum cut, the largest one.
    """
    count = len(terminal) - 1
    label = np.full(count + 1, FAR, np.int32)
    order = np.empty(count, np.uint32)
    # A ring with room for every node once and one place that tells full from empty.
    queue = np.empty(count + 1, np.uint32)
    queued = np.zeros(count + 1, np.bool_)
    alike = np.zeros(count + 2, np.int32)
    while True:
        reached = _label_all(beside, capacity, terminal, label, order)
        alike[:] = 0
        first, last = 0, 0
        # The farthest first: what they push is carried on by those they push it to.
        for place in range(reached - 1, -1, -1):
            node = order[place]
            alike[label[node]] += 1
            if terminal[node] > 0:
                queued[node] = True
                queue[last] = node
                last += 1
        if last == 0:
            return label
        gap = FAR
        patience = _PATIENCE * count
        while first != last and patience > 0:
            node = queue[first]
            first = 0 if first == count else first + 1
            queued[node] = False
            excess = terminal[node]
            here = label[node]
            # Beyond a label that nobody has, nothing leads to the sink.
            while excess > 0 and here < gap:
                lowest, below = FAR, here - 1
                for arc in range(ARCS):
                    amount = capacity[node, arc]
                    if amount == 0:
                        continue
                    other = beside[node, arc]
                    there = label[other]
                    if there != below:
                        lowest = min(lowest, there)
                        continue
                    amount = min(amount, excess)
                    capacity[node, arc] -= amount
                    capacity[other, arc ^ 4] += amount
                    excess_there = terminal[other] + amount
                    terminal[other] = excess_there
                    if excess_there > 0 and not queued[other]:
                        queued[other] = True
                        queue[last] = other
                        last = 0 if last == count else last + 1
                    excess -= amount
                    if excess == 0:
                        break
                if excess > 0:
                    patience -= 1
                    alike[here] -= 1
                    if alike[here] == 0:
                        gap = here
                    here = min(lowest + 1, FAR) if lowest < count else FAR
                    if here <= count:
                        alike[here] += 1
            label[node] = here
            terminal[node] = excess


@njit(cache=True, nogil=True)
def _label_all(beside, capacity, terminal, label, order):  # type: ignore[no-untyped-def]
    """Find the steps to the nearest node with capacity to the sink, breadth first."""
    count = len(terminal) - 1
    last = 0
    for node in range(count):
        if terminal[node] < 0:
            label[node] = 0
            order[last] = node
            last += 1
        else:
            label[node] = FAR
    # So that nobody looks for a neighbour where there is none.
    label[count] = 0
    first = 0
    while first < last:
        node = order[first]
        first += 1
        further = label[node] + 1
        for arc in range(ARCS):
            other = beside[node, arc]
            if label[other] == FAR and capacity[other, arc ^ 4] > 0:
                label[other] = further
                order[last] = other
                last += 1
    label[count] = FAR
    return last
