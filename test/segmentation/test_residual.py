# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.segmentation.residual import PersonalShape


def block(x: int) -> np.ndarray:
    mask = np.zeros((120, 100), np.uint8)
    mask[10:110, x : x + 30] = 255
    return mask


def test_it_is_ready_after_some_masks() -> None:
    shape = PersonalShape()
    for _ in range(4):
        shape.learn(block(35), BodyFrame(50, 60, 100), 0.1)
    assert not shape.ready
    shape.learn(block(35), BodyFrame(50, 60, 100), 0.1)
    assert shape.ready
    shape.reset()
    assert not shape.ready


def test_it_gives_back_what_it_was_shown_wherever_the_body_stands() -> None:
    shape = PersonalShape()
    for _ in range(6):
        shape.learn(block(35), BodyFrame(50, 60, 100), 0.1)
    same = shape.probability((120, 100), BodyFrame(50, 60, 100), 0.1)
    assert same[60, 50] == pytest.approx(1, abs=0.02)
    assert same[60, 20] == pytest.approx(0, abs=0.02)
    moved = shape.probability((120, 100), BodyFrame(70, 60, 100), 0.1)
    assert moved[60, 80] == pytest.approx(1, abs=0.02)
    assert moved[60, 40] == pytest.approx(0, abs=0.02)


def test_phases_are_remembered_apart() -> None:
    shape = PersonalShape()
    for _ in range(20):
        shape.learn(block(20), BodyFrame(50, 60, 100), 0.0)
        shape.learn(block(50), BodyFrame(50, 60, 100), 0.5)
    first = shape.probability((120, 100), BodyFrame(50, 60, 100), 0.0)
    second = shape.probability((120, 100), BodyFrame(50, 60, 100), 0.5)
    assert first[60, 30] > 0.8 > 0.3 > second[60, 30]
    assert second[60, 70] > 0.8 > 0.3 > first[60, 70]
