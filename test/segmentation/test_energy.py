# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.segmentation.energy import contrast_links, distance_links
from gait_segmentation.segmentation.graph_cut import CAPACITY, NEIGHBOURS


def free(shape: tuple[int, int]) -> np.ndarray:
    return np.zeros(shape, np.int8)


def test_flat_images_cost_the_full_weight_over_the_distance() -> None:
    links = contrast_links(np.full((3, 3, 3), 100, np.uint8), 2.0, free((3, 3)))
    for direction, (d_row, d_col) in enumerate(NEIGHBOURS):
        expected = int(2 * CAPACITY / np.hypot(d_row, d_col))
        inner = links[direction, 0, 1] if d_col <= 0 else links[direction, 0, 0]
        assert inner == expected


def test_links_out_of_the_image_are_zero() -> None:
    links = contrast_links(np.full((3, 4, 3), 7, np.uint8), 1.0, free((3, 4)))
    assert not links[0, :, -1].any()
    assert not links[1, -1].any()
    assert not links[2, -1].any()
    assert not links[2, :, -1].any()
    assert not links[3, :, 0].any()


def test_contrast_follows_boykov_and_jolly() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (6, 5, 3)).astype(np.uint8)
    links = contrast_links(image, 2.0, free((6, 5)))
    values = image.astype(float)
    squares = [
        ((values[:, 1:] - values[:, :-1]) ** 2).sum(2),
        ((values[1:] - values[:-1]) ** 2).sum(2),
        ((values[1:, 1:] - values[:-1, :-1]) ** 2).sum(2),
        ((values[1:, :-1] - values[:-1, 1:]) ** 2).sum(2),
    ]
    beta = 1 / (2 * np.mean(np.concatenate([square.ravel() for square in squares])))
    assert links[0, :, :-1] == pytest.approx(2 * CAPACITY * np.exp(-beta * squares[0]), abs=6)
    assert links[3, :-1, 1:] == pytest.approx(
        2 * CAPACITY / np.sqrt(2) * np.exp(-beta * squares[3]), abs=6
    )


def test_links_between_given_pixels_are_left_out() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (4, 4, 3)).astype(np.uint8)
    given = np.ones((4, 4), np.int8)
    given[:, 0] = 0
    links = contrast_links(image, 2.0, given)
    assert not links[:, :, 2:].any()
    assert links[0, :, 0].any()


def test_the_shape_term_is_the_mean_of_both_ends() -> None:
    psi = np.array([[0.0, 1.0], [0.5, 0.0]], np.float32)
    links = np.zeros((4, 2, 2), np.int32)
    distance_links(psi, 2.0, links)
    assert links[0, 0, 0] == int(2 * CAPACITY * 0.5)
    assert links[1, 0, 0] == int(2 * CAPACITY * 0.25)
    assert links[2, 0, 0] == 0
    assert links[3, 0, 1] == int(2 * CAPACITY * 0.75 / np.sqrt(2))


def test_the_shape_term_leaves_links_between_given_pixels_alone() -> None:
    given = np.ones((3, 4), np.int8)
    given[1, 1] = 0
    links = np.zeros((4, 3, 4), np.int32)
    distance_links(np.ones((3, 4), np.float32), 1.0, links, given)
    assert np.count_nonzero(links) == 8
    assert links[0, 1, 1] == CAPACITY
    assert links[0, 0, 0] == 0
