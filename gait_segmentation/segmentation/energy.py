# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The pairwise terms of the energy (paper, Eq. 2): contrast and distance to the template's outline.

Contrast is that of Boykov and Jolly, exp(-beta |I_p - I_q|^2) / dist(p, q) with beta from the
mean contrast of the window; the shape term is that of Freedman and Zhang (CVPR 2005): a cut link
costs what it is away from the template's outline, saturated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.segmentation.graph_cut import CAPACITY, STEPS, OpenGraph

__all__ = ['contrast_links', 'distance_links', 'mean_contrast']

_TABLE_END = 8.0
_TABLE_SIZE = 1024
_EXP = np.exp(-np.linspace(0, _TABLE_END, _TABLE_SIZE, dtype=np.float32))


@kernel('u1[:,:,::1], i4[::1], i4[:,::1], i8[:,::1], i4[:,::1]')
def _squares(
    image: NDArray[np.uint8],
    pixels: NDArray[np.int32],
    beside: NDArray[np.int32],
    steps: NDArray[np.int64],
    links: NDArray[np.int32],
) -> float:
    """Put squared contrasts into one of the two directions of each link; return their mean."""
    width = image.shape[1]
    flat = image.reshape(-1, 3)
    count = len(pixels)
    total = 0
    pairs = 0
    for node in range(count):
        here = pixels[node]
        for arc in range(8):
            other = beside[node, arc]
            if other == count or (arc >= 4 and other < count):
                continue
            there = here + steps[arc, 0] * width + steps[arc, 1]
            square = 0
            for channel in range(3):
                d = np.int32(flat[here, channel]) - np.int32(flat[there, channel])
                square += d * d
            links[node, arc] = square
            total += square
            pairs += 1
    return total / max(pairs, 1)


@kernel('i4[:,::1], f8, f8, f4[::1], i4[:,::1]')
def _weigh(
    beside: NDArray[np.int32],
    mean: float,
    weight: float,
    table: NDArray[np.float32],
    links: NDArray[np.int32],
) -> None:
    """Turn squared contrasts into capacities, in both directions."""
    count = len(beside) - 1
    beta = 1 / (2 * mean) if mean > 0 else 0.0
    to_table = beta * (table.size - 1) / _TABLE_END
    straight = weight * CAPACITY
    across = weight * CAPACITY / np.sqrt(2.0)
    for node in range(count):
        for arc in range(8):
            other = beside[node, arc]
            if other == count or (arc >= 4 and other < count):
                continue
            entry = min(int(links[node, arc] * to_table), table.size - 1)
            capacity = int((straight if arc & 2 == 0 else across) * table[entry])
            links[node, arc] = capacity
            if other < count:
                links[other, arc ^ 4] = capacity


def mean_contrast(graph: OpenGraph, image: NDArray[np.uint8]) -> float:
    """
    Return the mean squared contrast of the links.

    :param image: (h, w, 3) uint8.
    """
    links = np.empty_like(graph.links)
    image = np.ascontiguousarray(image)
    return float(_squares(image, graph.pixels, graph.beside, STEPS, links))


def contrast_links(
    graph: OpenGraph, image: NDArray[np.uint8], weight: float, mean: float | None = None
) -> None:
    """
    Set the links of a graph to their contrast term.

    :param image: (h, w, 3) uint8 in a space whose distances mean something (Lab or BGR).
    :param weight: its weight in the energy.
    :param mean: mean squared contrast, for beta; that of the graph itself if None.
    """
    image = np.ascontiguousarray(image)
    found = _squares(image, graph.pixels, graph.beside, STEPS, graph.links)
    _weigh(graph.beside, found if mean is None else mean, weight, _EXP, graph.links)


@kernel('f4[:,::1], i4[::1], i4[:,::1], i8[:,::1], f8, i4[:,::1]')
def _distance(
    psi: NDArray[np.float32],
    pixels: NDArray[np.int32],
    beside: NDArray[np.int32],
    steps: NDArray[np.int64],
    weight: float,
    links: NDArray[np.int32],
) -> None:
    width = psi.shape[1]
    flat = psi.reshape(-1)
    count = len(pixels)
    straight = weight * CAPACITY / 2
    across = weight * CAPACITY / (2 * np.sqrt(2.0))
    for node in range(count):
        here = pixels[node]
        for arc in range(8):
            if beside[node, arc] == count:
                continue
            there = here + steps[arc, 0] * width + steps[arc, 1]
            gain = straight if arc & 2 == 0 else across
            links[node, arc] += int(gain * (flat[here] + flat[there]))


def distance_links(graph: OpenGraph, psi: NDArray[np.float32], weight: float) -> None:
    """
    Add the shape term to the links of a graph: (psi_p + psi_q) / (2 dist(p, q)) each.

    :param psi: (h, w) float32 >= 0, what a cut costs at each pixel.
    :param weight: its weight in the energy.
    """
    psi = np.ascontiguousarray(psi)
    _distance(psi, graph.pixels, graph.beside, STEPS, weight, graph.links)
