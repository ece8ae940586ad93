# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from gait_segmentation.segmentation.graph_cut import CAPACITY, open_graph
from test.segmentation.grids import NEIGHBOURS, cut


def energy(labels: NDArray, logit: NDArray, links: NDArray) -> NDArray:
    """Return the energies of labellings (..., h, w), which a cut minimises, in capacities."""
    total = -((logit * CAPACITY).astype(np.int64) * labels).sum(axis=(-2, -1))
    height, width = logit.shape
    for direction, (d_row, d_col) in enumerate(NEIGHBOURS):
        for row, col in itertools.product(range(height), range(width)):
            if row + d_row < height and 0 <= col + d_col < width:
                differ = labels[..., row, col] != labels[..., row + d_row, col + d_col]
                total += int(links[direction, row, col]) * differ
    return total


def labellings(height: int, width: int) -> NDArray[np.bool_]:
    """Return all there are, (2 ** (h * w), h, w)."""
    bits = np.arange(2 ** (height * width))[:, None] >> np.arange(height * width)
    return (bits & 1 > 0).reshape(-1, height, width)


def random_problem(seed: int, shape: tuple[int, int]) -> tuple[NDArray, NDArray]:
    rng = np.random.default_rng(seed)
    logit = rng.normal(0, 2, shape).astype(np.float32)
    links = rng.integers(0, 2 * CAPACITY, (4, *shape)).astype(np.int32)
    return logit, links


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_no_labelling_has_less_energy(seed: int) -> None:
    logit, links = random_problem(seed, (3, 3))
    best = energy(labellings(3, 3), logit, links).min()
    assert energy(cut(logit, links), logit, links) == best


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_given_labels_hold_and_the_rest_is_optimal(seed: int) -> None:
    logit, links = random_problem(seed, (3, 4))
    rng = np.random.default_rng(seed + 1)
    fixed = rng.choice([-1, 0, 0, 1], (3, 4)).astype(np.int8)
    labels = cut(logit, links, fixed)
    assert np.all(labels[fixed > 0])
    assert not np.any(labels[fixed < 0])
    every = labellings(3, 4)
    allowed = every[(every[:, fixed != 0] == (fixed[fixed != 0] > 0)).all(axis=1)]
    assert energy(labels, logit, links) == energy(allowed, logit, links).min()


def test_everything_given_needs_no_graph() -> None:
    fixed = np.array([[1, -1], [-1, 1]], np.int8)
    labels = cut(np.zeros((2, 2), np.float32), np.zeros((4, 2, 2), np.int32), fixed)
    assert labels.tolist() == [[True, False], [False, True]]


@pytest.mark.parametrize('sign', [1, -1])
def test_one_pixel_follows_its_data_term(sign: int) -> None:
    logit = np.full((1, 1), sign * 2.0, np.float32)
    assert cut(logit, np.zeros((4, 1, 1), np.int32))[0, 0] == (sign > 0)


def test_of_equal_labellings_the_one_with_the_most_ones_wins() -> None:
    flat = np.zeros((2, 3), np.float32)
    assert cut(flat, np.zeros((4, 2, 3), np.int32)).all()
    logit = np.array([[1.0, 0.0, -1.0]], np.float32)
    links = np.zeros((4, 1, 3), np.int32)
    links[0, 0, :2] = 50
    assert cut(logit, links).tolist() == [[True, True, False]]


def test_a_graph_knows_what_is_beside_its_pixels() -> None:
    graph = open_graph(np.array([[0, 1, 0], [-1, 0, 0]], np.int8))
    assert graph.pixels.tolist() == [0, 2, 4, 5]
    # Four are open, so 4 is beyond the window, 5 has label 0 and 6 label 1.
    assert graph.beside[0].tolist() == [6, 5, 2, 4, 4, 4, 4, 4]
    assert graph.beside[2].tolist() == [3, 4, 4, 4, 5, 6, 0, 1]
    assert (graph.beside[4] == 4).all()
    assert not graph.links.any()
