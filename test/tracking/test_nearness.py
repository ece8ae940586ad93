# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.nearness import REACH, nearness


def blob(shape: tuple[int, int], seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).integers(0, 256, shape, np.uint8)
    smooth = cv2.GaussianBlur(noise, (0, 0), 3.0)
    return np.where(smooth > np.median(smooth), np.uint8(255), np.uint8(0))


@pytest.mark.parametrize('shape', [(60, 90), (31, 7), (3, 40)])
@pytest.mark.parametrize('seed', range(3))
def test_distances_are_those_of_the_chamfer_metric(shape: tuple[int, int], seed: int) -> None:
    mask = blob(shape, seed)
    near = nearness(mask, 1000.0)
    assert near is not None
    within = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
    without = cv2.distanceTransform(255 - mask, cv2.DIST_L2, 3)
    np.testing.assert_allclose(near.distance, (within - without)[near.part], atol=1e-3)


def test_only_what_is_near_is_measured() -> None:
    mask = np.zeros((200, 160), np.uint8)
    mask[80:120, 70:90] = 255
    near = nearness(mask, 100.0)
    assert near is not None
    elsewhere = np.ones(mask.shape, np.bool_)
    elsewhere[near.part] = False
    distance = cv2.distanceTransform(255 - mask, cv2.DIST_L2, 3)
    assert distance[elsewhere].min() > REACH * 100
    assert near.distance.size < mask.size / 5
    # At the border of the image there is no more.
    at_border = nearness(mask[85:, 75:], 100.0)
    assert at_border is not None
    assert at_border.part[0].start == at_border.part[1].start == 0
    assert at_border.distance[0, 0] > 0


def test_nothing_is_near_to_an_empty_mask() -> None:
    assert nearness(np.zeros((20, 30), np.uint8), 100.0) is None
