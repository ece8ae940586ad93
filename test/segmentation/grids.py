# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Links of graphs of open pixels as images: (4, h, w), those of a pixel to the four after it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.segmentation.graph_cut import STEPS, OpenGraph, minimum_cut, open_graph

NEIGHBOURS = tuple((int(row), int(column)) for row, column in STEPS[:4])


def links_of(graph: OpenGraph) -> NDArray[np.int32]:
    """Return the links as images; both directions must agree."""
    links = np.full((4, *graph.given.shape), -1, np.int32)
    for node, arc, place in _arcs(graph):
        assert links[place] in (-1, graph.links[node, arc])
        links[place] = graph.links[node, arc]
    return np.maximum(links, 0)


def cut(
    logit: NDArray[np.float32], links: NDArray[np.int32], given: NDArray[np.int8] | None = None
) -> NDArray[np.bool_]:
    """Return the cut of least energy with any links."""
    graph = open_graph(np.zeros(logit.shape, np.int8) if given is None else given)
    for node, arc, place in _arcs(graph):
        graph.links[node, arc] = links[place]
    return minimum_cut(graph, logit.reshape(-1)[graph.pixels])


def _arcs(graph: OpenGraph) -> Iterator[tuple[int, int, tuple[int, int, int]]]:
    """Return node, arc and the arc's place in images of links."""
    height, width = graph.given.shape
    for node, pixel in enumerate(graph.pixels):
        for arc, (d_row, d_column) in enumerate(STEPS):
            row, column = divmod(int(pixel), width)
            inside = 0 <= row + d_row < height and 0 <= column + d_column < width
            assert inside == (graph.beside[node, arc] != len(graph.pixels))
            if inside and arc < 4:
                yield node, arc, (arc, row, column)
            elif inside:
                yield node, arc, (arc - 4, int(row + d_row), int(column + d_column))
