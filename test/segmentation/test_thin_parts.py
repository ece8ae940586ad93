# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np

from gait_segmentation.segmentation.energy import contrast_links
from gait_segmentation.segmentation.graph_cut import OpenGraph, minimum_cut, open_graph
from gait_segmentation.segmentation.thin_parts import loosen_thin_parts

HEIGHT = 120.0


def body_with_arm() -> tuple[np.ndarray, np.ndarray]:
    """Return the mask of a trunk with a thin arm away from it, and that of the arm's hand."""
    body = np.zeros((140, 120), np.uint8)
    cv2.ellipse(body, (70, 70), (16, 55), 0, 0, 360, 1, -1)
    cv2.line(body, (60, 45), (30, 85), 1, 3)
    hand = np.zeros_like(body)
    hand[75:85] = body[75:85]
    hand[:, 45:] = 0
    return body > 0, hand > 0


def data_of(body: np.ndarray, inside: float = 1.6) -> np.ndarray:
    return np.where(body, inside, -4).astype(np.float32)


def graph_of(shape: tuple[int, int]) -> OpenGraph:
    """Return the graph of a flat image, all of it open."""
    graph = open_graph(np.zeros(shape, np.int8))
    contrast_links(graph, np.full((*shape, 3), 90, np.uint8), 2.0)
    return graph


def test_a_thin_arm_that_the_data_term_shows_is_not_cut_off() -> None:
    body, hand = body_with_arm()
    data = data_of(body)
    graph = graph_of(body.shape)
    assert minimum_cut(graph, data.ravel())[hand].mean() < 0.1
    loosen_thin_parts(graph, data, HEIGHT)
    labels = minimum_cut(graph, data.ravel())
    assert labels[hand].mean() > 0.8
    assert (labels & ~body).sum() < 0.02 * body.sum()


def test_links_about_what_is_thick_stay() -> None:
    body = np.zeros((140, 120), np.uint8)
    cv2.ellipse(body, (60, 70), (16, 55), 0, 0, 360, 1, -1)
    graph = graph_of(body.shape)
    before = graph.links.copy()
    loosen_thin_parts(graph, data_of(body > 0), HEIGHT)
    assert (graph.links != before).any(axis=1).sum() < 0.02 * body.sum()


def test_links_stay_the_same_in_both_directions() -> None:
    body, _ = body_with_arm()
    graph = graph_of(body.shape)
    before = graph.links.copy()
    loosen_thin_parts(graph, data_of(body), HEIGHT)
    assert (graph.links != before).any()
    nodes = np.arange(len(graph.pixels))
    for arc in range(4):
        other = graph.beside[:-1, arc]
        inside = other < len(nodes)
        back = graph.links[other[inside], arc + 4]
        assert np.array_equal(graph.links[:-1][inside, arc], back)


def test_single_pixels_loosen_nothing() -> None:
    body, _ = body_with_arm()
    data = data_of(np.zeros_like(body))
    data[20::13, 10::11] = 4
    graph = graph_of(body.shape)
    before = graph.links.copy()
    loosen_thin_parts(graph, data, HEIGHT)
    assert np.array_equal(graph.links, before)


def test_faint_edges_of_the_data_term_loosen_little() -> None:
    body, hand = body_with_arm()
    graph = graph_of(body.shape)
    before = graph.links.copy()
    loosen_thin_parts(graph, np.where(body, 0.2, -0.2).astype(np.float32), HEIGHT)
    there = hand.ravel()[graph.pixels]
    assert graph.links[:-1][there].sum() > 0.8 * before[:-1][there].sum()
