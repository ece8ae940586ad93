# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np

from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.likelihood.spreading import spread_evidence

SHAPE = (100, 80)
ALL = (slice(0, 100), slice(0, 80))
WALL, SHIRT = (150, 128, 140), (60, 130, 120)
SIGMA, TALL = 4.0, 100.0

GHOST = (slice(20, 80), slice(20, 30))
BODY = (slice(20, 80), slice(30, 50))
FRONT = (slice(20, 80), slice(44, 50))


def scene() -> tuple[np.ndarray, np.ndarray]:
    """
    Return an even wall with a dark body, (h, w, 3) uint8 Lab, and what is known of the wall.

    Unknown is what the first mask covered: the ghost behind the body, and the body but for its
    front, that has gone on over wall already seen.
    """
    lab = np.empty((*SHAPE, 3), np.uint8)
    lab[:] = WALL
    lab[BODY] = SHIRT
    sums = np.empty((*SHAPE, 4), np.float32)
    sums[:] = 5 * np.array([*WALL, 1], np.float32)
    sums[GHOST] = sums[BODY] = 0
    sums[FRONT] = 5 * np.array([*WALL, 1], np.float32)
    return lab, sums


def spread(
    lab: np.ndarray,
    sums: np.ndarray,
    template: np.ndarray | None = None,
    moving: np.ndarray | None = None,
) -> np.ndarray:
    if template is None:
        template = np.zeros(SHAPE, np.uint8)
        template[BODY] = 255
    if moving is None:
        moving = np.zeros(SHAPE, np.float32)
    return spread_evidence(lab, known(sums), ALL, moving, template, TALL, 0.5)


def known(sums: np.ndarray) -> BackgroundModel:
    model = BackgroundModel((0, 0))
    model.sums, model.sigma = sums, SIGMA
    return model


def test_wall_that_runs_on_behind_the_body_is_wall_and_the_body_is_not() -> None:
    evidence = spread(*scene())
    assert evidence.dtype == np.float32
    assert evidence.shape == SHAPE
    assert evidence[40:60, 21:29].max() < -0.5
    assert evidence[40:60, 34:43].min() > 0.2


def test_what_is_known_is_left_to_the_likelihood() -> None:
    lab, sums = scene()
    assert not np.any(spread(lab, sums)[sums[..., 3] >= 1])


def test_evidence_stays_within_one() -> None:
    lab, sums = scene()
    moving = np.full(SHAPE, -2, np.float32)
    assert np.abs(spread(lab, sums, moving=moving)).max() <= 1


def test_an_edge_stops_it() -> None:
    lab, sums = scene()
    open_side = spread(lab, sums)[50, 25]
    lab[18:82, 18:20] = lab[18:20, 18:32] = lab[80:82, 18:32] = SHIRT
    assert spread(lab, sums)[50, 25] > open_side + 0.3


def test_nothing_speaks_against_the_person_inside_of_the_template_or_for_it_elsewhere() -> None:
    lab, sums = scene()
    every, none = np.full(SHAPE, 255, np.uint8), np.zeros(SHAPE, np.uint8)
    assert spread(lab, sums, every).min() >= 0
    assert spread(lab, sums, none).max() <= 0


def test_a_shadow_is_not_the_person() -> None:
    lab, sums = scene()
    lab[BODY] = (WALL[0] * 7 // 10, *WALL[1:])
    assert spread(lab, sums).max() < 0.1


def test_what_moves_with_the_body_tells_of_the_rest_of_it() -> None:
    lab, sums = scene()
    sums[FRONT] = 0
    without = spread(lab, sums)[50, 38]
    moving = np.zeros(SHAPE, np.float32)
    moving[:, 44:50] = 2
    assert spread(lab, sums, moving=moving)[50, 38] > max(without, 0) + 0.2


def test_where_nothing_is_known_nothing_is_said() -> None:
    lab, _ = scene()
    assert not np.any(spread(lab, np.zeros((*SHAPE, 4), np.float32)))


def _filtered(image: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Smooth there and back along rows and columns, then back and there, line by line."""
    image = image.copy()
    for forth in (True, False, False, True):
        for links, lines in ((across.T, image.T), (down, image)):
            order = range(1, len(lines)) if forth else range(len(lines) - 2, -1, -1)
            for k in order:
                last = k - 1 if forth else k + 1
                lines[k] += links[min(k, last)] * (lines[last] - lines[k])
    return image


def test_it_is_the_recursive_filter_of_evidence_over_that_of_sureness() -> None:
    rng = np.random.default_rng(6)
    for shape in ((7, 9), (12, 5)):
        lab = rng.integers(100, 130, (*shape, 3), np.uint8)
        sums = np.zeros((*shape, 4), np.float32)
        moving = rng.uniform(-2, 2, shape).astype(np.float32)
        template = rng.integers(0, 256, shape, np.uint8)
        window = (slice(0, shape[0]), slice(0, shape[1]))
        found = spread_evidence(lab, known(sums), window, moving, template, TALL, 0.5)
        smooth = cv2.GaussianBlur(lab, (3, 3), 0).astype(int)
        across, down = np.zeros(shape), np.zeros(shape)
        across[:, :-1] = np.abs(np.diff(smooth, axis=1)).sum(axis=2)
        down[:-1] = np.abs(np.diff(smooth, axis=0)).sum(axis=2)
        across, down = (
            np.exp(-np.sqrt(2) * (each / 10 + 1 / (0.12 * TALL))) for each in (across, down)
        )
        sure = 0.5 * np.abs(moving)
        evidence = _filtered(sure * moving / 2, across, down)
        value = evidence / (_filtered(sure, across, down) + 0.05)
        likely = template / 255
        value *= np.where(value > 0, 0.6 * likely, 1 - likely)
        np.testing.assert_allclose(found, value, atol=1e-4)
