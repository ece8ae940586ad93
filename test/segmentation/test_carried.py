# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.segmentation.carried import Carried

SHAPE = (120, 160)


def scene(x: int, width: int = 15) -> np.ndarray:
    image = np.zeros(SHAPE, np.uint8)
    image[60:80, x : x + width] = 255
    return image


def test_what_moves_with_the_body_is_carried_after_some_frames() -> None:
    carried = Carried()
    for n in range(24):
        body = BodyFrame(40 + 2 * n, 60, 80 + n / 2)
        there = carried.at(body, SHAPE)
        assert n > 10 or not there.any()
        carried.learn(scene(60 + 2 * n), body)
    rows, columns = np.nonzero(carried.at(BodyFrame(88, 60, 92), SHAPE))
    assert 55 < rows.mean() < 85
    assert 105 < columns.mean() < 130
    assert 100 < len(rows) < 350


def test_what_stays_behind_is_not() -> None:
    carried = Carried()
    for n in range(30):
        body = BodyFrame(40 + 4 * n, 60, 80)
        assert not carried.at(body, SHAPE).any()
        carried.learn(scene(60), body)


def test_nor_is_what_is_as_wide_as_a_door_and_passed_at_a_walk() -> None:
    carried = Carried()
    for n in range(30):
        body = BodyFrame(30 + 3.2 * n, 60, 80)
        assert not carried.at(body, SHAPE).any()
        carried.learn(scene(60, width=32), body)


def test_a_turned_body_carries_what_turns_with_it() -> None:
    carried = Carried()
    for _ in range(20):
        carried.learn(scene(70), BodyFrame(80, 60, 80))
    upright = carried.at(BodyFrame(80, 60, 80), SHAPE)
    upside_down = carried.at(BodyFrame(80, 60, 80, np.pi), SHAPE)
    assert upright[65:78, 72:83].all()
    assert np.mean(upside_down[::-1, ::-1] == upright) > 0.97
