# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The minimum cut of a grid graph in which only some pixels are open.

Capacities are integers (the Boykov-Kolmogorov solver is a third faster on them); pixels whose
label is given are not nodes but are folded into the t-links of their neighbours.
"""

from __future__ import annotations

import cv2
import maxflow
import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['CAPACITY', 'NEIGHBOURS', 'decided', 'minimum_cut']

CAPACITY = 256
"""Integer capacity of an energy of one."""

NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""(row, column) steps of the four n-links a pixel has to pixels after it."""

_SURE, _NEAR_PX = 2.0, 2
"""Log-odds that are sure, and how far about a pixel all must be."""

_STEPS = np.array(NEIGHBOURS, np.int64)


@njit(cache=True, nogil=True)
def _number(given: NDArray[np.int8], index: NDArray[np.int32]) -> int:
    count = 0
    for row in range(given.shape[0]):
        for col in range(given.shape[1]):
            if given[row, col] == 0:
                index[row, col] = count
                count += 1
            else:
                index[row, col] = -1
    return count


@njit(cache=True, nogil=True)
def _build(
    logit: NDArray[np.float32],
    links: NDArray[np.int32],
    given: NDArray[np.int8],
    index: NDArray[np.int32],
    steps: NDArray[np.int64],
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    capacity: NDArray[np.int32],
    source: NDArray[np.int32],
    sink: NDArray[np.int32],
) -> int:
    height, width = logit.shape
    edges = 0
    for row in range(height):
        for col in range(width):
            here = index[row, col]
            if here >= 0:
                energy = int(logit[row, col] * CAPACITY)
                if energy >= 0:
                    source[here] += energy
                else:
                    sink[here] -= energy
            for direction in range(4):
                next_row = row + steps[direction, 0]
                next_col = col + steps[direction, 1]
                if next_row >= height or next_col < 0 or next_col >= width:
                    continue
                link = links[direction, row, col]
                there = index[next_row, next_col]
                if here >= 0 and there >= 0:
                    first[edges] = here
                    second[edges] = there
                    capacity[edges] = link
                    edges += 1
                elif here >= 0:
                    if given[next_row, next_col] > 0:
                        source[here] += link
                    else:
                        sink[here] += link
                elif there >= 0:
                    if given[row, col] > 0:
                        source[there] += link
                    else:
                        sink[there] += link
    return edges


def decided(logit: NDArray[np.float32]) -> NDArray[np.int8]:
    """
    Return the pixels whose label is as good as certain before any cut, (h, w) int8.

    A pixel is decided if it and all pixels near it are sure of the same label: an outline through
    there would cost the data term on both sides of it.

    :param logit: (h, w) float32, log-odds of label 1.
    :returns: +1 or -1 where decided, 0 elsewhere.
    """
    kernel = np.ones((2 * _NEAR_PX + 1, 2 * _NEAR_PX + 1), np.uint8)
    sure = cv2.erode((logit > _SURE).astype(np.uint8), kernel)
    never = cv2.erode((logit < -_SURE).astype(np.uint8), kernel)
    return sure.astype(np.int8) - never.astype(np.int8)


def minimum_cut(
    logit: NDArray[np.float32], links: NDArray[np.int32], given: NDArray[np.int8] | None = None
) -> NDArray[np.bool_]:
    """
    Return the labelling of least energy.

    The energy of labels A in {0, 1} is ``-sum(A_p logit_p)`` plus, for every pair of neighbours
    with different labels, the link between them over :data:`CAPACITY`.

    :param logit: (h, w) float32, log-odds of label 1 (data term, t-links).
    :param links: (4, h, w) int32 >= 0, capacity of the n-links along :data:`NEIGHBOURS`.
    :param given: (h, w) int8, +1 or -1 where label 1 or 0 is given, 0 where open; None = all open.
    :returns: (h, w) bool, True for label 1.
    """
    if given is None:
        given = np.zeros(logit.shape, np.int8)
    index = np.empty(logit.shape, np.int32)
    nodes = int(_number(given, index))
    labels = given > 0
    if nodes == 0:
        return labels
    first = np.empty(4 * nodes, np.int32)
    second = np.empty_like(first)
    capacity = np.empty_like(first)
    source = np.zeros(nodes, np.int32)
    sink = np.zeros(nodes, np.int32)
    edges = _build(logit, links, given, index, _STEPS, first, second, capacity, source, sink)
    graph = maxflow.GraphInt(nodes, edges)
    ids = graph.add_nodes(nodes)
    if edges:
        graph.add_edges(first[:edges], second[:edges], capacity[:edges], capacity[:edges])
    graph.add_grid_tedges(ids, source, sink)
    graph.maxflow()
    # PyMaxflow calls the sink's side True; the sink's side is label 0.
    labels[index >= 0] = ~graph.get_grid_segments(ids)
    return labels
