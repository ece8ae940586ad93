# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.estimator import MotionEstimator
from gait_segmentation.ego_motion.ground_finder import GroundFinder, ground_of
from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.ego_motion.world_motion import Ground
from gait_segmentation.geometry import Box, scaling

END, SLOPE = 120, 0.05
PERSON = Box(120, 64, 90, 128)


def texture(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    small = rng.integers(0, 255, (60, 100)).astype(np.uint8)
    return cv2.resize(small, (400, 240), interpolation=cv2.INTER_CUBIC)


def followed_by(frame: float, slope: float = SLOPE) -> np.ndarray:
    """Return a wall that stands still, and before it ground that passes faster the nearer."""
    y, x = np.mgrid[:240, :400].astype(np.float32)
    off = np.float32(slope * frame) * np.maximum(y - END, 0)
    return cv2.remap(texture(1), x - off, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)


def found(frames: list[np.ndarray]) -> list[Ground | None]:
    estimator = MotionEstimator()
    people = np.zeros((240, 400), np.uint8)
    people[PERSON.slices(400, 240)] = 1
    out = []
    for frame in frames:
        motion = estimator.update(Pyramid(frame), people)
        out.append(estimator.with_ground(motion, people, [PERSON]).ground)
    return out


def test_ground_that_passes_before_a_wall_is_found_with_its_end() -> None:
    first, second, *grounds = found([followed_by(k) for k in range(5)])
    assert first is None
    # What is seen for a single moment may be the legs of a passer-by.
    assert second is None
    for ground in grounds:
        assert ground is not None
        for row in (140, 180):
            there = ground.motion @ [200, row, 1]
            assert there == pytest.approx([200 + SLOPE * (row - END), row], abs=0.4)
        assert abs(ground.row - END) < 12


def test_where_all_stands_still_there_is_no_other_ground() -> None:
    assert found([followed_by(0)] * 7) == [None] * 7


def test_ground_not_seen_for_a_moment_goes_on_as_before() -> None:
    plain = followed_by(4)
    plain[END + 5 :] = 128
    grounds = found([followed_by(k) for k in range(4)] + [plain])[1:]
    assert grounds[2] is not None
    assert grounds[3] is not None
    assert grounds[3].row == grounds[2].row
    at = [200, 180, 1]
    assert grounds[3].motion @ at == pytest.approx(grounds[2].motion @ at, abs=0.2)


def test_few_corners_say_nothing() -> None:
    before = np.array([[k, 10.0 * k] for k in range(8)], np.float32)
    after = before + np.float32([[0.5 * k, 0] for k in range(8)])
    assert ground_of(before, after, scaling(1.0), (0, 50)) is not None
    assert ground_of(before[1:], after[1:], scaling(1.0), (0, 50)) is None


def test_people_at_whose_legs_nothing_of_the_image_is_left_show_no_ground() -> None:
    estimator = MotionEstimator()
    people = np.ones((240, 400), np.uint8)
    for frame in (followed_by(0), followed_by(1)):
        motion = estimator.update(Pyramid(frame), people)
        assert estimator.with_ground(motion, people, [PERSON]).ground is None


def test_ground_that_does_not_move_is_sought_now_and_then_only() -> None:
    finder = GroundFinder()
    frames, clear = (Pyramid(followed_by(0)),) * 2, np.ones((120, 200), np.uint8)
    turns = []
    for _ in range(11):
        turns.append(finder.take_turn())
        if turns[-1]:
            assert finder.find(frames, None, clear, [PERSON]) is None
    assert turns == [True, *[False] * 4] * 2 + [True]


def test_ground_that_suddenly_moves_otherwise_is_not_believed_for_some_frames() -> None:
    places = [*range(4), *(3 + 1.6 * k for k in range(1, 15))]
    grounds = found([followed_by(place) for place in places])
    shifts = [None if each is None else (each.motion @ [200, 180, 1])[0] - 200 for each in grounds]
    fast, slow = 1.6 * SLOPE * 60, SLOPE * 60
    assert shifts[2:7] == pytest.approx([slow] * 5, abs=0.4)
    # What goes on for so long is no passer-by.
    assert shifts[-1] == pytest.approx(fast, abs=0.4)


def test_what_moves_evenly_as_a_whole_is_no_ground() -> None:
    rows = np.linspace(0, 100, 20, dtype=np.float32)
    before = np.stack([10 + rows % 7, rows], axis=1)
    assert ground_of(before, before + np.float32((3, 0)), scaling(1.0), (0, 50)) is None
    sheared = before + np.stack([0.05 * np.maximum(rows - 20, 0), 0 * rows], axis=1)
    ground = ground_of(before, sheared.astype(np.float32), scaling(1.0), (0, 50))
    assert ground is not None
    assert ground.row == pytest.approx(20, abs=6)
