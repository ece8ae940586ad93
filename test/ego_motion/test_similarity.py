# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.ego_motion.similarity import camera_motion

TRUE = np.array([[1.02, -0.03, 4.0], [0.03, 1.02, -7.0]])


def points(count: int = 40) -> np.ndarray:
    return np.random.default_rng(2).uniform((0, 0), (320, 240), (count, 2)).astype(np.float32)


def carried(before: np.ndarray) -> np.ndarray:
    return (before @ TRUE[:, :2].T + TRUE[:, 2]).astype(np.float32)


def test_points_on_things_that_move_by_themselves_do_not_count() -> None:
    before, after = points(), carried(points())
    after[::3] += np.float32([30, 5])
    np.testing.assert_allclose(camera_motion(before, after), TRUE, atol=1e-3)


@pytest.mark.parametrize('seed', range(4))
def test_slow_walkers_do_not_pull_the_world_along(seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = rng.uniform((0, 0), (580, 430), (60, 2)).astype(np.float32)
    after = before + rng.normal((0.5, 0.3), 0.1, before.shape).astype(np.float32)
    # With a zoom of 1/400 they would nearly agree with the rest.
    after[np.argsort(before[:, 0])[-15:], 0] -= 2
    motion = camera_motion(before, after)
    assert motion is not None
    assert motion @ [290, 215, 1] == pytest.approx((290.5, 215.3), abs=0.15)


@pytest.mark.parametrize('after', [points(), points() + np.float32(0.1), carried(points()[::-1])])
def test_points_that_stand_still_or_do_not_agree_have_no_motion(after: np.ndarray) -> None:
    assert camera_motion(points(), after) is None


def test_few_points_have_no_motion() -> None:
    assert camera_motion(points(7), carried(points(7))) is None
