# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.segmentation.oriented_edges import (
    image_gradient,
    silhouette_edges,
    smoothing,
)


def disk(radius: int = 40) -> np.ndarray:
    mask = np.zeros((120, 120), np.uint8)
    cv2.circle(mask, (60, 60), radius, 255, -1)
    return mask


def test_the_outline_of_a_disk_is_on_it_and_its_gradient_radial() -> None:
    points = silhouette_edges(disk(), 80)
    away = np.hypot(points.rows - 60, points.columns - 60)
    np.testing.assert_allclose(away, 40, atol=1.6)
    assert len(points.rows) > 220
    radial = np.arctan2(points.rows - 60, points.columns - 60) % np.pi
    turn = np.abs(points.orientation - radial)
    assert np.minimum(turn, np.pi - turn).max() < 0.2


def test_orientation_is_in_half_a_turn_and_the_same_for_the_opposite_contrast() -> None:
    dark = image_gradient((200 - disk() // 2).astype(np.uint8))
    light = image_gradient((72 + disk() // 2).astype(np.uint8))
    assert dark.orientation.min() >= 0
    assert dark.orientation.max() < np.pi
    strong = dark.visible & light.visible
    turn = np.abs(dark.orientation - light.orientation)[strong]
    assert np.minimum(turn, np.pi - turn).max() < 1e-3


@pytest.mark.parametrize('level', [0, 5, 200])
def test_a_plain_image_has_no_edges(level: int) -> None:
    gradient = image_gradient(np.full((30, 40), level, np.uint8))
    assert not gradient.visible.any()
    assert not gradient.edges.any()


def test_faint_noise_in_the_dark_is_no_edge() -> None:
    noise = np.random.default_rng(1).integers(0, 3, (60, 60)).astype(np.uint8)
    assert not image_gradient(noise).edges.any()


def test_an_empty_silhouette_has_no_outline() -> None:
    assert silhouette_edges(np.zeros((20, 20), np.uint8), 20).rows.size == 0


def test_smoothing_follows_the_height_within_limits() -> None:
    assert smoothing(10) == 0.5
    assert smoothing(100) == pytest.approx(1.2)
    assert smoothing(1000) == 1.5
