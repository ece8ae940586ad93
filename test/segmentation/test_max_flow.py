# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import maxflow
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from gait_segmentation.segmentation.max_flow import ARCS, FAR, push_flow

STEPS = ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1))


random_grids = given(
    st.integers(0, 10_000),
    st.integers(1, 24),
    st.integers(1, 24),
    st.sampled_from([0, 1, 7, 500]),
    st.sampled_from([0, 1, 300]),
)


def grid_graph(
    seed: int, height: int, width: int, largest: int, terminal: int
) -> tuple[NDArray, NDArray, NDArray]:
    """Return a graph of all pixels of a grid with random capacities, the same both ways."""
    rng = np.random.default_rng(seed)
    count = height * width
    beside = np.full((count + 1, ARCS), count, np.int32)
    capacity = np.zeros((count + 1, ARCS), np.int32)
    for node in range(count):
        for arc, (down, right) in enumerate(STEPS[:4]):
            row, col = node // width + down, node % width + right
            if row < height and 0 <= col < width:
                other = row * width + col
                beside[node, arc], beside[other, arc ^ 4] = other, node
                amount = rng.integers(0, largest + 1)
                capacity[node, arc] = capacity[other, arc ^ 4] = amount
    ends = np.zeros(count + 1, np.int32)
    ends[:-1] = rng.integers(-terminal, terminal + 1, count)
    return beside, capacity, ends


@settings(max_examples=30)
@random_grids
def test_the_flow_fills_the_cut_it_returns(
    seed: int, height: int, width: int, largest: int, terminal: int
) -> None:
    """A flow as large as a cut is a largest flow, and the cut a smallest one."""
    beside, capacity, ends = grid_graph(seed, height, width, largest, terminal)
    left, rest = capacity.copy(), ends.copy()
    label = push_flow(beside, left, rest)
    source = label == FAR
    assert (left >= 0).all()
    flow = int(np.minimum(rest, 0).sum() - np.minimum(ends, 0).sum())
    crossing = source[:, None] & ~source[beside]
    cut = int(capacity[crossing].sum())
    cut -= int(np.minimum(ends, 0)[source].sum())
    cut += int(np.maximum(ends, 0)[~source].sum())
    assert flow == cut
    # What is left with the sink's side has no way to be more than the sink takes.
    assert not (rest[~source] > 0).any()
    assert not left[crossing].any()


@settings(max_examples=30)
@random_grids
def test_the_cut_is_that_of_boykov_and_kolmogorov(
    seed: int, height: int, width: int, largest: int, terminal: int
) -> None:
    """PyMaxflow, a program of others, finds the same flow and the same, largest source's side."""
    beside, capacity, ends = grid_graph(seed, height, width, largest, terminal)
    count = height * width
    other = maxflow.GraphInt(count, 4 * count)
    other.add_nodes(count)
    for node in range(count):
        other.add_tedge(node, max(int(ends[node]), 0), max(-int(ends[node]), 0))
        for arc in range(4):
            if beside[node, arc] < count:
                amount = int(capacity[node, arc])
                other.add_edge(node, int(beside[node, arc]), amount, amount)
    rest = ends.copy()
    label = push_flow(beside, capacity.copy(), rest)
    assert other.maxflow() == int(np.minimum(rest, 0).sum() - np.minimum(ends, 0).sum())
    # Both give the source whatever cannot reach the sink.
    segments = [other.get_segment(node) for node in range(count)]
    assert segments == (label[:-1] != FAR).tolist()


def test_what_cannot_reach_the_sink_is_with_the_source() -> None:
    beside = np.array([[1] + [2] * 7, [2] * 4 + [0] + [2] * 3, [2] * 8], np.int32)
    capacity = np.zeros((3, ARCS), np.int32)
    label = push_flow(beside, capacity, np.array([5, -5, 0], np.int32))
    assert label[0] == FAR
    assert label[1] == 0


@pytest.mark.parametrize(('room', 'alone'), [(9, False), (3, True)])
def test_flow_goes_through_neutral_nodes(room: int, alone: bool) -> None:
    """A row of three: source 5, nothing, sink 6."""
    none = 3
    beside = np.full((4, ARCS), none, np.int32)
    capacity = np.zeros((4, ARCS), np.int32)
    for node in (0, 1):
        beside[node, 0], beside[node + 1, 4] = node + 1, node
        capacity[node, 0] = capacity[node + 1, 4] = room
    ends = np.array([5, 0, -6, 0], np.int32)
    label = push_flow(beside, capacity, ends)
    assert (label[0] == FAR) == alone
    assert ends.tolist() == ([2, 0, -3, 0] if alone else [0, 0, -1, 0])
