# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.segmentation.energy import contrast_links, distance_links, mean_contrast
from gait_segmentation.segmentation.graph_cut import CAPACITY, open_graph
from test.segmentation.grids import NEIGHBOURS, links_of


def contrast_of(image: np.ndarray, weight: float, given: np.ndarray | None = None) -> np.ndarray:
    graph = open_graph(np.zeros(image.shape[:2], np.int8) if given is None else given)
    contrast_links(graph, image, weight)
    return links_of(graph)


def test_flat_images_cost_the_full_weight_over_the_distance() -> None:
    links = contrast_of(np.full((3, 3, 3), 100, np.uint8), 2.0)
    for direction, (d_row, d_col) in enumerate(NEIGHBOURS):
        expected = int(2 * CAPACITY / np.hypot(d_row, d_col))
        inner = links[direction, 0, 1] if d_col <= 0 else links[direction, 0, 0]
        assert inner == expected


def test_links_out_of_the_image_are_zero() -> None:
    graph = open_graph(np.zeros((3, 4), np.int8))
    contrast_links(graph, np.full((3, 4, 3), 7, np.uint8), 1.0)
    distance_links(graph, np.ones((3, 4), np.float32), 1.0)
    beyond = graph.beside == len(graph.pixels)
    assert not graph.links[beyond].any()
    assert graph.links[~beyond].all()


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


def test_the_mean_contrast_may_be_that_of_another_graph() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (6, 5, 3)).astype(np.uint8)
    whole = open_graph(np.zeros((6, 5), np.int8))
    given = np.ones((6, 5), np.int8)
    given[2:4, 1:3] = 0
    contrast_links(whole, image, 2.0)
    part = open_graph(given)
    contrast_links(part, image, 2.0, mean_contrast(whole, image))
    found = links_of(part)
    assert (found == np.where(found > 0, links_of(whole), 0)).all()


def test_links_between_given_pixels_do_not_count() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (4, 4, 3)).astype(np.uint8)
    given = np.ones((4, 4), np.int8)
    given[:, 0] = 0
    links = contrast_of(image, 2.0, given)
    assert not links[:, :, 2:].any()
    assert links[0, :, 0].any()
    changed = image.copy()
    changed[:, 2:] = 0
    assert (contrast_of(changed, 2.0, given) == links).all()


def test_the_shape_term_is_the_mean_of_both_ends() -> None:
    psi = np.array([[0.0, 1.0], [0.5, 0.0]], np.float32)
    graph = open_graph(np.zeros((2, 2), np.int8))
    distance_links(graph, psi, 2.0)
    links = links_of(graph)
    assert links[0, 0, 0] == int(2 * CAPACITY * 0.5)
    assert links[1, 0, 0] == int(2 * CAPACITY * 0.25)
    assert links[2, 0, 0] == 0
    assert links[3, 0, 1] == int(2 * CAPACITY * 0.75 / np.sqrt(2))


def test_the_shape_term_is_on_all_links_of_open_pixels() -> None:
    given = np.ones((3, 4), np.int8)
    given[1, 1] = 0
    graph = open_graph(given)
    distance_links(graph, np.ones((3, 4), np.float32), 1.0)
    links = links_of(graph)
    assert np.count_nonzero(links) == 8
    assert links[0, 1, 1] == CAPACITY
    assert links[0, 0, 0] == 0


def test_the_mean_contrast_of_two_pixels_is_that_of_their_link() -> None:
    image = np.array([[[1, 2, 3], [5, 2, 0]]], np.uint8)
    assert mean_contrast(open_graph(np.zeros((1, 2), np.int8)), image) == 25
