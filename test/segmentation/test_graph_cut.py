# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from gait_segmentation.segmentation.graph_cut import (
    CAPACITY,
    STEPS,
    OpenGraph,
    contrast_links,
    distance_links,
    mean_contrast,
    minimum_cut,
    open_graph,
    refine,
    upsample,
)

# Links are images: (4, h, w), those of a pixel to the four after it.
NEIGHBOURS = tuple((int(row), int(column)) for row, column in STEPS[:4])


def links_of(graph: OpenGraph) -> NDArray[np.int32]:
    """Return the links as images; both directions must agree."""
    links = np.full((4, *graph.fixed.shape), -1, np.int32)
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
    height, width = graph.fixed.shape
    for node, pixel in enumerate(graph.pixels):
        for arc, (d_row, d_column) in enumerate(STEPS):
            row, column = divmod(int(pixel), width)
            inside = 0 <= row + d_row < height and 0 <= column + d_column < width
            assert inside == (graph.beside[node, arc] != len(graph.pixels))
            if inside and arc < 4:
                yield node, arc, (arc, row, column)
            elif inside:
                yield node, arc, (arc - 4, int(row + d_row), int(column + d_column))


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


def contrast_of(image: np.ndarray, weight: float, given: np.ndarray | None = None) -> np.ndarray:
    graph = open_graph(np.zeros(image.shape[:2], np.int8) if given is None else given)
    contrast_links(graph, image, weight)
    return links_of(graph)


def test_contrast_follows_boykov_and_jolly() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (6, 5, 3)).astype(np.uint8)
    links = contrast_of(image, 2.0)
    values = image.astype(float)
    squares = [
        ((values[:, 1:] - values[:, :-1]) ** 2).sum(2),
        ((values[1:] - values[:-1]) ** 2).sum(2),
        ((values[1:, 1:] - values[:-1, :-1]) ** 2).sum(2),
        ((values[1:, :-1] - values[:-1, 1:]) ** 2).sum(2),
    ]
    mean = np.mean(np.concatenate([square.ravel() for square in squares]))
    assert mean_contrast(open_graph(np.zeros((6, 5), np.int8)), image) == pytest.approx(mean)
    beta = 1 / (2 * mean)
    assert links[0, :, :-1] == pytest.approx(2 * CAPACITY * np.exp(-beta * squares[0]), abs=6)
    assert links[3, :-1, 1:] == pytest.approx(
        2 * CAPACITY / np.sqrt(2) * np.exp(-beta * squares[3]), abs=6
    )


def test_the_shape_term_is_the_mean_of_both_ends() -> None:
    psi = np.array([[0.0, 1.0], [0.5, 0.0]], np.float32)
    graph = open_graph(np.zeros((2, 2), np.int8))
    distance_links(graph, psi, 2.0)
    links = links_of(graph)
    assert links[0, 0, 0] == int(2 * CAPACITY * 0.5)
    assert links[1, 0, 0] == int(2 * CAPACITY * 0.25)
    assert links[2, 0, 0] == 0
    assert links[3, 0, 1] == int(2 * CAPACITY * 0.75 / np.sqrt(2))


def test_the_outline_moves_to_the_edge_of_the_image() -> None:
    rng = np.random.default_rng(0)
    cv2.ellipse(image := np.zeros((120, 90), np.uint8), (45, 60), (25, 45), 0, 0, 360, 1, -1)
    true = image > 0
    picture = np.where(true[:, :, None], (60, 60, 200), (160, 160, 90)).astype(np.int16)
    picture = np.clip(picture + rng.normal(0, 4, picture.shape), 0, 255).astype(np.uint8)
    coarse = cv2.resize(image, (30, 40), interpolation=cv2.INTER_AREA) > 0
    logit = np.where(coarse, 1.0, -1.0).astype(np.float32) * 0.2
    plain = upsample(coarse, true.shape)
    fine = refine(picture, coarse, logit, 2.0)
    assert (fine != true).sum() < 0.5 * (plain != true).sum()


def test_the_data_term_is_interpolated_where_the_outline_is() -> None:
    # Without contrast every open pixel follows its own evidence.
    labels = np.zeros((20, 30), np.bool_)
    labels[5:15, 8:20] = True
    logit = np.random.default_rng(3).normal(0, 1, (20, 30)).astype(np.float32)
    shape = (47, 68)
    fine = cv2.resize(logit, shape[::-1], interpolation=cv2.INTER_LINEAR)
    found = refine(np.zeros((*shape, 3), np.uint8), labels, logit, 0.0)
    first = upsample(labels, shape)
    moved = found != first
    assert moved.any()
    assert ((fine > -0.01) | ~found)[moved].all()
    assert ((fine < 0.01) | found)[moved].all()


def test_corners_are_as_round_at_any_resolution() -> None:
    """A working pixel's evidence is shared by the pixels that it becomes."""
    labels = np.zeros((20, 30), np.bool_)
    labels[5:15, 8:20] = True
    logit = np.where(labels, 1.0, -1.0).astype(np.float32)
    for factor in (2, 3, 4, 5):
        flat = np.zeros((20 * factor, 30 * factor, 3), np.uint8)
        area = refine(flat, labels, logit, 2.0).sum() / factor**2
        assert 100 < area < 106
