# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The minimum cut of a grid graph in which only some pixels are open.

Capacities are integers; pixels whose label is given are not nodes but are folded into the t-links
of their neighbours.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.segmentation.max_flow import ARCS, FAR, push_flow

__all__ = ['ALL_STEPS', 'CAPACITY', 'NEIGHBOURS', 'decided', 'minimum_cut']

CAPACITY = 256
"""Integer capacity of an energy of one."""

NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""(row, column) steps of the four n-links a pixel has to pixels after it."""

ALL_STEPS = np.array([*NEIGHBOURS, *((-row, -column) for row, column in NEIGHBOURS)], np.int64)
"""(8, 2) int64, these and those to the pixels before it, in the order of a node's arcs."""

_SURE, _NEAR_PX = 2.0, 2
"""Log-odds that are sure, and how far about a pixel all must be."""


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
    beside: NDArray[np.int32],
    capacity: NDArray[np.int32],
    terminal: NDArray[np.int32],
) -> None:
    """Fill in the graph of the open pixels, as :func:`push_flow` takes it."""
    height, width = logit.shape
    count = len(terminal) - 1
    beside[count] = count
    capacity[count] = 0
    terminal[count] = 0
    for row in range(height):
        for col in range(width):
            node = index[row, col]
            if node < 0:
                continue
            energy = int(logit[row, col] * CAPACITY)
            for arc in range(ARCS):
                next_row, next_col = row + steps[arc, 0], col + steps[arc, 1]
                beside[node, arc] = count
                capacity[node, arc] = 0
                if not (0 <= next_row < height and 0 <= next_col < width):
                    continue
                link = links[arc, row, col] if arc < 4 else links[arc - 4, next_row, next_col]
                other = index[next_row, next_col]
                if other >= 0:
                    beside[node, arc] = other
                    capacity[node, arc] = link
                elif given[next_row, next_col] > 0:
                    energy += link
                else:
                    energy -= link
            terminal[node] = energy


@njit(cache=True, nogil=True)
def _read_off(
    index: NDArray[np.int32], label: NDArray[np.int32], labels: NDArray[np.bool_]
) -> None:
    for row in range(index.shape[0]):
        for col in range(index.shape[1]):
            if index[row, col] >= 0:
                labels[row, col] = label[index[row, col]] == FAR


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
    with different labels, the link between them over :data:`CAPACITY`.  Of several labellings of
    the same energy it is the one with the most ones.

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
    beside = np.empty((nodes + 1, ARCS), np.int32)
    capacity = np.empty((nodes + 1, ARCS), np.int32)
    terminal = np.empty(nodes + 1, np.int32)
    _build(logit, links, given, index, ALL_STEPS, beside, capacity, terminal)
    _read_off(index, push_flow(beside, capacity, terminal), labels)
    return labels
