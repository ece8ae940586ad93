# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import scaling
from gait_segmentation.tracking.cues import motion_logit, propagation_logit

WINDOW = (slice(10, 70), slice(10, 90))
STILL = scaling(1.0)


def shift(dx: float, dy: float = 0.0) -> np.ndarray:
    return np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])


def test_what_moves_with_the_body_is_person_and_what_stays_is_not() -> None:
    rng = np.random.default_rng(0)
    world = rng.integers(0, 255, (80, 100)).astype(np.uint8)
    cloth = rng.integers(0, 255, (80, 100)).astype(np.uint8)
    person = np.zeros((80, 100), np.bool_)
    person[20:60, 30:50] = True
    earlier = np.where(person, cloth, world)
    now = np.where(np.roll(person, 10, 1), np.roll(cloth, 10, 1), world)
    logit = motion_logit(now, earlier, STILL, shift(10), WINDOW)
    assert logit[25, 38] == pytest.approx(2)
    assert logit[25, 70] == pytest.approx(-2)
    assert np.abs(logit).max() <= 2


def test_the_propagated_mask_moves_with_the_body() -> None:
    mask = np.zeros((80, 100), np.uint8)
    mask[20:60, 30:50] = 255
    logit = propagation_logit(mask, shift(10), WINDOW, 50.0)
    assert logit[25, 38] == pytest.approx(3)
    assert logit[25, 22] < 0
    assert logit[25, 70] == pytest.approx(-3)
