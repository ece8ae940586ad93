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


def open_graph(given: NDArray[np.int8]) -> OpenGraph:
    """
    Return the graph of the open pixels, without links.

    :param given: (h, w) int8, +1 or -1 where label 1 or 0 is given, 0 where open.
    """
    pixels = np.flatnonzero(given == 0).astype(np.int32)
    count = len(pixels)
    # By the rows of a window with a border, of what lies where.
    place = np.full((given.shape[0] + 2, given.shape[1] + 2), count, np.int32)
    inner = place[1:-1, 1:-1]
    inner[...] = np.where(given < 0, count + 1, count + 2)
    inner.reshape(given.shape)[given == 0] = np.arange(count, dtype=np.int32)
    row, column = np.divmod(pixels, given.shape[1])
    here = (row + 1) * place.shape[1] + column + 1
    beside = np.full((count + 1, ARCS), count, np.int32)
    beside[:-1] = place.reshape(-1)[here[:, None] + STEPS @ (place.shape[1], 1)]
    return OpenGraph(given, pixels, beside, np.zeros(beside.shape, np.int32))


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
    links, beside = graph.links[:-1], graph.beside[:-1]
    # Links to given labels are t-links.
    toward = (beside == count + 2).astype(np.int32) - (beside == count + 1)
    terminal = (logit * CAPACITY).astype(np.int64) + np.einsum('ij,ij->i', links, toward)
    forward, after = links[:, : ARCS // 2], beside[:, : ARCS // 2]
    one, arc = np.nonzero((after < count) & (forward > 0))
    other, capacity = after[one, arc], forward[one, arc]
    solver = maxflow.GraphInt(count, len(one))
    nodes = solver.add_grid_nodes(count)
    solver.add_edges(one, other, capacity, capacity)
    solver.add_grid_tedges(nodes, np.maximum(terminal, 0), np.maximum(-terminal, 0))
    solver.maxflow()
    # Label 1 is the source's side, to which PyMaxflow counts what cannot reach the sink.
    labels.reshape(-1)[graph.pixels] = ~solver.get_grid_segments(nodes)
    return labels
