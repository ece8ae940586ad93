# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The minimum cut of a grid graph in which only some pixels are open.

Capacities are integers; pixels whose label is given are not nodes but are folded into the t-links
of their neighbours.  All work is on the open pixels, which are few; the cut itself is PyMaxflow's,
of Boykov and Kolmogorov (PAMI 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import maxflow
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['CAPACITY', 'STEPS', 'OpenGraph', 'decided', 'minimum_cut', 'open_graph']

ARCS = 8
"""Arcs of a node; arc ``a`` of one end is arc ``a ^ 4`` of the other."""

CAPACITY = 256
"""Integer capacity of an energy of one."""

_FORWARD = ((0, 1), (1, 0), (1, 1), (1, -1))
STEPS = np.array([*_FORWARD, *((-row, -column) for row, column in _FORWARD)], np.int64)
"""(8, 2) int64, rows and columns to the neighbours of a pixel: four after it, and the opposite
ones before it; the first two of four are straight."""

_SURE, _NEAR_PX = 2.0, 2
"""Log-odds that are sure, and how far about a pixel all must be."""


@dataclass(frozen=True)
class OpenGraph:
    """
    The open pixels of a window and their links.

    ``given`` is (h, w) int8, +1 or -1 where label 1 or 0 is given, and ``pixels`` (N,) int32 the
    places in it of the N others, row by row.  ``beside`` (N + 1, 8) int32 are their neighbours at
    :data:`STEPS`: a place among the open ones, N beyond the window, N + 1 for a pixel with label
    0 and N + 2 for one with label 1.  ``links`` (N + 1, 8) int32 >= 0 are the capacities to them,
    equal in both directions, and 0 beyond the window.
    """

    given: NDArray[np.int8]
    pixels: NDArray[np.int32]
    beside: NDArray[np.int32]
    links: NDArray[np.int32]


@kernel('i1[:,::1], i4[:,::1], i4[::1]')
def _number(given: NDArray[np.int8], index: NDArray[np.int32], pixels: NDArray[np.int32]) -> int:
    count = 0
    for row in range(given.shape[0]):
        for col in range(given.shape[1]):
            if given[row, col] == 0:
                index[row, col] = count
                pixels[count] = row * given.shape[1] + col
                count += 1
            else:
                index[row, col] = -1 if given[row, col] < 0 else -2
    return count


@kernel('i4[:,::1], i4[::1], i8[:,::1], i4[:,::1]')
def _connect(
    index: NDArray[np.int32],
    pixels: NDArray[np.int32],
    steps: NDArray[np.int64],
    beside: NDArray[np.int32],
) -> None:
    height, width = index.shape
    count = len(pixels)
    for node in range(count):
        row, col = divmod(pixels[node], width)
        for arc in range(ARCS):
            next_row, next_col = row + steps[arc, 0], col + steps[arc, 1]
            beside[node, arc] = count
            if 0 <= next_row < height and 0 <= next_col < width:
                other = index[next_row, next_col]
                beside[node, arc] = other if other >= 0 else count - other
    for arc in range(ARCS):
        beside[count, arc] = count


def open_graph(given: NDArray[np.int8]) -> OpenGraph:
    """
    Return the graph of the open pixels, without links.

    :param given: (h, w) int8, +1 or -1 where label 1 or 0 is given, 0 where open.
    """
    index = np.empty(given.shape, np.int32)
    pixels = np.empty(given.size, np.int32)
    pixels = pixels[: _number(given, index, pixels)]
    beside = np.empty((len(pixels) + 1, ARCS), np.int32)
    _connect(index, pixels, STEPS, beside)
    return OpenGraph(given, pixels, beside, np.zeros(beside.shape, np.int32))


@kernel('f4[::1], i4[:,::1], i4[:,::1], i8[:,::1], i8[::1]')
def _fold(
    logit: NDArray[np.float32],
    links: NDArray[np.int32],
    beside: NDArray[np.int32],
    edges: NDArray[np.int64],
    terminal: NDArray[np.int64],
) -> int:
    """
    List the links between open pixels, and turn those to given labels into t-links.

    :param edges: (3, E) of both ends and the capacity, filled in.
    :param terminal: (N,) of the capacity from the source, or to the sink if negative, filled in.
    :returns: how many edges there are.
    """
    count, total = len(logit), 0
    for node in range(count):
        energy = int(logit[node] * CAPACITY)
        for arc in range(ARCS):
            other = beside[node, arc]
            if other == count + 1:
                energy -= links[node, arc]
            elif other == count + 2:
                energy += links[node, arc]
            elif other < count and arc < ARCS // 2 and links[node, arc] > 0:
                edges[0, total] = node
                edges[1, total] = other
                edges[2, total] = links[node, arc]
                total += 1
        terminal[node] = energy
    return total


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


def minimum_cut(graph: OpenGraph, logit: NDArray[np.float32]) -> NDArray[np.bool_]:
    """
    Return the labelling of least energy.

    The energy of labels A in {0, 1} is ``-sum(A_p logit_p)`` plus, for every pair of neighbours
    with different labels, the link between them over :data:`CAPACITY`.  Of several labellings of
    the same energy it is the one with the most ones.

    :param graph: the open pixels and their links.
    :param logit: (N,) float32, their log-odds of label 1 (data term, t-links).
    :returns: (h, w) bool, True for label 1.
    """
    labels = graph.given > 0
    count = len(graph.pixels)
    if count == 0:
        return labels
    edges = np.empty((3, count * ARCS // 2), np.int64)
    terminal = np.empty(count, np.int64)
    total = _fold(logit, graph.links, graph.beside, edges, terminal)
    one, other, capacity = edges[:, :total]
    solver = maxflow.GraphInt(count, total)
    nodes = solver.add_grid_nodes(count)
    solver.add_edges(one, other, capacity, capacity)
    solver.add_grid_tedges(nodes, np.maximum(terminal, 0), np.maximum(-terminal, 0))
    solver.maxflow()
    # Label 1 is the source's side, to which PyMaxflow counts what cannot reach the sink.
    labels.reshape(-1)[graph.pixels] = ~solver.get_grid_segments(nodes)
    return labels
