# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.finding.recollection import Recollection, agreed, spread

SHAPE = (20, 30)
WALL = (190, 124, 135)


def wall(count: int = 10) -> Recollection:
    mean = np.full((*SHAPE, 3), WALL, np.uint8)
    window = (slice(0, SHAPE[0]), slice(0, SHAPE[1]))
    return Recollection(window, mean, np.full(SHAPE, count, np.uint8), 4.0)


def evidence(colour: tuple[float, float, float], count: int = 10) -> float:
    lab = np.full((*SHAPE, 3), np.rint(colour), np.uint8)
    return float(wall(count).evidence(lab, 0.5)[0, 0])


@pytest.mark.parametrize('share', [0.95, 0.85, 0.75])
def test_shade_on_a_wall_is_the_wall_the_lighter_the_surer(share: float) -> None:
    lightness, chroma = WALL[0], (np.array(WALL[1:]) - 128)
    a, b = 128 + share * chroma
    said = evidence((share * lightness, a, b))
    assert evidence(WALL) <= said < -1
    assert said < evidence(((share - 0.1) * lightness, a, b))


def test_what_is_lighter_or_coloured_or_black_is_a_person() -> None:
    lightness, a, b = WALL
    assert evidence((1.2 * lightness, a, b)) > 1
    assert evidence((0.85 * lightness, a + 20, b)) > 1
    assert evidence((0.3 * lightness, a, b)) > 1


def test_where_nothing_is_known_nothing_is_said() -> None:
    assert evidence(WALL, count=0) == evidence((20, 128, 128), count=1) == 0
    assert abs(evidence(WALL, count=2)) < abs(evidence(WALL, count=9))


def test_most_frames_must_agree() -> None:
    images = np.full((5, 1, 3, 3), 100, np.uint8)
    masks = np.zeros((5, 1, 3), np.uint8)
    images[:2, 0, 0] = 180
    images[3, 0, 0] = 104
    images[:, 0, 1] = np.array([0, 50, 100, 150, 200])[:, None]
    masks[:, 0, 2] = 255
    mean, count = agreed(images, masks)
    assert count[0].tolist() == [3, 0, 0]
    assert mean[0, 0].tolist() == [101, 101, 101]


def test_the_spread_follows_the_differences() -> None:
    few, many = np.full((20, 3), 9, np.uint8), np.full((200, 3), 9, np.uint8)
    assert spread(few) == spread(many[:40])
    assert spread(np.zeros((200, 3), np.uint8)) < spread(np.full((200, 3), 3, np.uint8))
    assert spread(np.full((200, 3), 200, np.uint8)) == 14.0
