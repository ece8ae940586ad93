# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The energy of a labelling (paper, Eq. 2), and its minimum where only some pixels are open.

The contrast term is that of Boykov and Jolly, exp(-beta |I_p - I_q|^2) / dist(p, q) with beta from
the mean contrast of the window; the shape term is that of Freedman and Zhang (CVPR 2005): a cut
link costs what it is away from the template's outline, saturated.

Capacities are integers; pixels whose label is fixed are not nodes but are folded into the t-links
of their neighbours.  All work is on the open pixels, which are few, and most of these are settled
by their own t-links, against whatever their links say; the cut of the rest is PyMaxflow's, of
Boykov and Kolmogorov (PAMI 2004).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import maxflow
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import shrink
from gait_segmentation.kernels import kernel

ARCS = 8
"""Arcs of a node; arc ``a`` of one end is arc ``a ^ 4`` of the other."""

CAPACITY = 256
"""Integer capacity of an energy of one."""

_TABLE_END = 8.0
_EXP = np.exp(-np.linspace(0, _TABLE_END, 1024, dtype=np.float32))  # exp(-x) for x up to its end
_FORWARD = ((0, 1), (1, 0), (1, 1), (1, -1))
STEPS = np.array([*_FORWARD, *((-row, -column) for row, column in _FORWARD)], np.int64)
"""(8, 2) int64, rows and columns to the neighbours of a pixel: four after it, and the opposite
ones before it; the first two of four are straight."""

_SURE = 2.0  # log-odds that are
_NEAR_PX = 2  # how far about a pixel all must be sure
# Most that the second cut is finer than the first: 320 px for a person at the standard size.
_FINEST = 2.5


@dataclass(frozen=True)
class OpenGraph:
    """
    The open pixels of a window and their links.

    ``fixed`` is (h, w) int8, +1 or -1 where label 1 or 0 is fixed, and ``pixels`` (N,) int32 the
    places in it of the N others, row by row.  ``beside`` (N + 1, 8) int32 are their neighbours at
    :data:`STEPS`: a place among the open ones, N beyond the window, N + 1 for a pixel with label
    0 and N + 2 for one with label 1.  ``links`` (N + 1, 8) int32 >= 0 are the capacities to them,
    equal in both directions, and 0 beyond the window.
    """

    fixed: NDArray[np.int8]
    pixels: NDArray[np.int32]
    beside: NDArray[np.int32]
    links: NDArray[np.int32]


def open_graph(fixed: NDArray[np.int8]) -> OpenGraph:
    """Return the graph of the open pixels: 0 in (h, w) int8; +1 or -1 where a label is fixed."""
    pixels = np.empty(fixed.size - cv2.countNonZero(fixed), np.int32)
    beside = np.full((len(pixels) + 1, ARCS), len(pixels), np.int32)
    _find_open(fixed, pixels, beside)
    return OpenGraph(fixed, pixels, beside, np.zeros(beside.shape, np.int32))


@kernel('i1[:,::1], i4[::1], i4[:,::1]')
def _find_open(fixed, pixels, beside):  # type: ignore[no-untyped-def]
    """Fill in places and neighbours of the open pixels, see :class:`OpenGraph`."""
    count = np.int32(len(pixels))
    # By the rows of a window with a border, of what lies where.
    place = np.full((fixed.shape[0] + 2, fixed.shape[1] + 2), count, np.int32)
    found = np.int32(0)
    for row in range(fixed.shape[0]):
        for col in range(fixed.shape[1]):
            label = fixed[row, col]
            if label == 0:
                pixels[found] = row * fixed.shape[1] + col
                place[row + 1, col + 1] = found
                found += 1
            else:
                place[row + 1, col + 1] = count + 1 if label < 0 else count + 2
    for node in range(count):
        row, col = divmod(pixels[node], fixed.shape[1])
        for arc in range(ARCS):
            beside[node, arc] = place[row + 1 + STEPS[arc, 0], col + 1 + STEPS[arc, 1]]


def decided(logit: NDArray[np.float32]) -> NDArray[np.int8]:
    """
    Return the pixels whose label is as good as certain before any cut, (h, w) int8.

    A pixel is decided if it and all pixels near it are sure of the same label: an outline through
    there would cost the data term on both sides of it.

    :param logit: (h, w) float32, log-odds of label 1.
    :returns: +1 or -1 where decided, 0 elsewhere.
    """
    kernel = np.ones((2 * _NEAR_PX + 1, 2 * _NEAR_PX + 1), np.uint8)
    sure = cv2.erode((logit > _SURE).view(np.uint8), kernel)
    never = cv2.erode((logit < -_SURE).view(np.uint8), kernel)
    return sure.view(np.int8) - never.view(np.int8)


@kernel('u1[:,:,::1], i4[::1], i4[:,::1], i4[:,::1]')
def _squares(image, pixels, beside, links):  # type: ignore[no-untyped-def]
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
            there = here + STEPS[arc, 0] * width + STEPS[arc, 1]
            square = 0
            for channel in range(3):
                d = np.int32(flat[here, channel]) - np.int32(flat[there, channel])
                square += d * d
            links[node, arc] = square
            total += square
            pairs += 1
    return total / max(pairs, 1)


@kernel('i4[:,::1], f8, f8, i4[:,::1]')
def _weigh(beside, mean, weight, links):  # type: ignore[no-untyped-def]
    """Turn squared contrasts into capacities, in both directions."""
    count = len(beside) - 1
    beta = 1 / (2 * mean) if mean > 0 else 0.0
    to_table = beta * (_EXP.size - 1) / _TABLE_END
    straight = weight * CAPACITY
    across = weight * CAPACITY / np.sqrt(2.0)
    for node in range(count):
        for arc in range(8):
            other = beside[node, arc]
            if other == count or (arc >= 4 and other < count):
                continue
            entry = min(int(links[node, arc] * to_table), _EXP.size - 1)
            capacity = int((straight if arc & 2 == 0 else across) * _EXP[entry])
            links[node, arc] = capacity
            if other < count:
                links[other, arc ^ 4] = capacity


def mean_contrast(graph: OpenGraph, image: NDArray[np.uint8]) -> float:
    """Return the mean squared contrast of the links in an image, (h, w, 3) uint8."""
    links = np.empty_like(graph.links)
    image = np.ascontiguousarray(image)
    return float(_squares(image, graph.pixels, graph.beside, links))


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
    found = _squares(image, graph.pixels, graph.beside, graph.links)
    _weigh(graph.beside, found if mean is None else mean, weight, graph.links)


@kernel('f4[:,::1], i4[::1], i4[:,::1], f8, i4[:,::1]')
def _distance(psi, pixels, beside, weight, links):  # type: ignore[no-untyped-def]
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
            there = here + STEPS[arc, 0] * width + STEPS[arc, 1]
            gain = straight if arc & 2 == 0 else across
            links[node, arc] += int(gain * (flat[here] + flat[there]))


def distance_links(graph: OpenGraph, psi: NDArray[np.float32], weight: float) -> None:
    """
    Add the shape term to the links of a graph: (psi_p + psi_q) / (2 dist(p, q)) each.

    :param psi: (h, w) float32 >= 0, what a cut costs at each pixel.
    :param weight: its weight in the energy.
    """
    _distance(np.ascontiguousarray(psi), graph.pixels, graph.beside, weight, graph.links)


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
    labels = graph.fixed > 0
    count = len(graph.pixels)
    if count == 0:
        return labels
    settled, terminal = np.empty(count + 3, np.int8), np.empty(count, np.int32)
    pairs = np.empty((3, ARCS // 2 * count), np.int32)
    nodes, edges = _settle(graph.beside, graph.links, logit, settled, terminal, pairs)
    found = settled[:count]
    if nodes:
        solver = maxflow.GraphInt(nodes, edges)
        grid = solver.add_grid_nodes(nodes)
        one, other, capacity = pairs[:, :edges]
        solver.add_edges(one, other, capacity, capacity)
        rest = terminal[:nodes]
        solver.add_grid_tedges(grid, np.maximum(rest, 0), np.maximum(-rest, 0))
        solver.maxflow()
        # Label 1 is the source's side, to which PyMaxflow counts what cannot reach the sink.
        found[found == 0] = np.where(solver.get_grid_segments(grid), -1, 1)
    labels.reshape(-1)[graph.pixels] = found > 0
    return labels


@njit(nogil=True, inline='always')
def _own_label(terminal, weight):  # type: ignore[no-untyped-def]
    """Return the label a t-link gives whatever those of the neighbours are, 0 without one."""
    if terminal >= weight:
        return 1
    return -1 if -terminal > weight else 0


@kernel('i4[:,::1], i4[:,::1], f4[::1], i1[::1], i4[::1], i4[:,::1]')
def _settle(beside, links, logit, settled, terminal, pairs):  # type: ignore[no-untyped-def]
    """Settle nodes whose t-link is worth all their links; list the nodes and pairs left."""
    count = len(logit)
    # What is fixed, and what is beyond the window, to which links are 0.
    settled[:count], settled[count], settled[count + 1], settled[count + 2] = 0, 1, -1, 1
    weight, waiting = np.empty(count, np.int32), np.empty(count, np.int32)
    waits = nodes = edges = 0
    for node in range(count):
        terminal[node], weight[node] = np.int32(logit[node] * np.float32(CAPACITY)), 0
        for arc in range(ARCS):
            label, link = settled[beside[node, arc]], links[node, arc]
            terminal[node] += label * link
            weight[node] += link if label == 0 else 0
    for node in range(count):
        settled[node] = _own_label(terminal[node], weight[node])
        if settled[node] != 0:
            waiting[waits] = node
            waits += 1
    while waits > 0:
        waits -= 1
        node = waiting[waits]
        for arc in range(ARCS):
            other, link = beside[node, arc], links[node, arc]
            if settled[other] == 0:
                terminal[other] += settled[node] * link
                weight[other] -= link
                settled[other] = _own_label(terminal[other], weight[other])
                if settled[other] != 0:
                    waiting[waits] = other
                    waits += 1
    place = weight
    for node in range(count):
        if settled[node] == 0:
            terminal[nodes], place[node] = terminal[node], nodes
            nodes += 1
    for node in range(count):
        if settled[node] == 0:
            for arc in range(ARCS // 2):
                other, link = beside[node, arc], links[node, arc]
                if settled[other] == 0 and link > 0:
                    pairs[0, edges], pairs[1, edges] = place[node], place[other]
                    pairs[2, edges] = link
                    edges += 1
    return nodes, edges


def finest(image: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Return a window as fine as its outline is cut.

    Finer than that the outline is interpolated: the nodes of the cut would grow with the square
    of the resolution, for a fraction of a percent of the body's height.

    :param image: (H, W, 3) uint8, the window at full resolution.
    :param shape: (h, w) of the first cut of it.
    """
    if image.shape[0] <= _FINEST * shape[0]:
        return image
    return shrink(image, (math.ceil(_FINEST * shape[0]), math.ceil(_FINEST * shape[1])))


def upsample(labels: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return a mask at another size, its outline interpolated."""
    if labels.shape == shape:
        return labels
    values = labels.view(np.uint8) * np.uint8(255)
    grown = cv2.resize(values, shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(grown > 127)


def refine(
    image: NDArray[np.uint8],
    labels: NDArray[np.bool_],
    logit: NDArray[np.float32],
    contrast: float,
) -> NDArray[np.bool_]:
    """
    Cut again at the size of the image, a pixel of the first cut about its outline.

    :param image: (H, W, 3) uint8, the window at full resolution, or as :func:`finest` gives it.
    :param labels: (h, w) bool, the first cut of the same window at working size.
    :param logit: (h, w) float32, its data term.
    :param contrast: weight of the contrast term of the first cut.
    :returns: (H, W) bool.
    """
    shape = image.shape[:2]
    scale = labels.shape[0] / shape[0]
    if labels.shape == shape:
        return labels
    refined = upsample(labels, shape)
    reach = max(1, round(1 / scale))
    found = Box.around(refined)
    if found is None:
        return refined
    part = found.slices(shape[1], shape[0], reach + 1)
    area = refined[part].view(np.uint8)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    fixed = cv2.erode(area, kernel).view(np.int8) + cv2.dilate(area, kernel).view(np.int8)
    fixed -= np.int8(1)
    graph = open_graph(fixed)
    if len(graph.pixels) == 0:
        return refined
    cut = np.ascontiguousarray(image[part])
    # A working pixel's evidence is shared by 1/scale^2 pixels, a link's by 1/scale of them.
    fine = cv2.resize(logit, shape[::-1], interpolation=cv2.INTER_LINEAR)[part]
    data = np.float32(scale) * fine.reshape(-1)[graph.pixels]
    contrast_links(graph, cut, contrast)
    refined[part] = minimum_cut(graph, data)
    return refined
