# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.tracking.likelihood.cues import add_motion
from gait_segmentation.warping import warp_window

WINDOW = (slice(10, 70), slice(10, 90))


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
    logit = np.zeros((60, 80), np.float32)
    add_motion(logit, now, earlier, WorldMotion(), shift(10), WINDOW, 1.0)
    assert logit[25, 38] == pytest.approx(2)
    assert logit[25, 70] == pytest.approx(-2)
    assert np.abs(logit).max() <= 2


@pytest.mark.parametrize(
    'window',
    [(slice(5, 40), slice(8, 60)), (slice(0, 60), slice(0, 80)), (slice(7, 8), slice(9, 11))],
)
def test_the_evidence_is_the_difference_of_what_the_two_motions_leave(
    window: tuple[slice, slice],
) -> None:
    rng = np.random.default_rng(9)
    then, now = (
        cv2.GaussianBlur(rng.integers(0, 256, (60, 80), np.uint8), (0, 0), 2) for _ in range(2)
    )
    camera = np.array([[1.001, 0.002, 1.3], [-0.002, 1.001, -0.4]])
    body = np.array([[1.0, 0.0, 3.5], [0.0, 1.0, 0.25]])
    logit = rng.normal(0, 1, now[window].shape).astype(np.float32)
    before = logit.copy()
    evidence = add_motion(logit, now, then, WorldMotion(camera), body, window, 0.6)
    stays, moves = (
        np.minimum(
            cv2.blur(cv2.absdiff(now[window], warp_window(then, each, window)), (3, 3)), 30
        ).astype(float)
        for each in (camera, body)
    )
    expected = np.clip((stays**2 - moves**2) / (2 * 12.0**2), -2, 2)
    np.testing.assert_allclose(evidence, expected, atol=1e-5)
    np.testing.assert_allclose(logit, before + 0.6 * expected, atol=1e-5)
