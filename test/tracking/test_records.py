# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.working import WorkingImage
from gait_segmentation.scene.world_motion import WorldMotion, warp_window
from gait_segmentation.tracking.records import Record, add_moving, moving_pixels

WINDOW = (slice(10, 70), slice(10, 90))
STILL = WorldMotion()


def shift(dx: float, dy: float = 0.0) -> np.ndarray:
    return np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])


def test_what_moves_against_the_world_is_found_and_the_panned_world_is_not() -> None:
    rng = np.random.default_rng(0)
    world = rng.integers(0, 255, (80, 120)).astype(np.uint8)
    earlier, now = world[:, :100].copy(), world[:, 4:104].copy()
    earlier[30:40, 30:40], now[30:40, 46:56] = 0, 0
    moving = moving_pixels(now, earlier, WorldMotion(shift(-4)), WINDOW, spread=2.0)
    assert moving.shape == (60, 80)
    assert moving[25, 40]
    assert not moving[:, :10].any()
    assert not moving[40:, 10:].any()


@pytest.mark.parametrize('shape', [(60, 80), (41, 33), (5, 6), (2, 9), (7, 1), (1, 1), (0, 4)])
@pytest.mark.parametrize('spread', [0.5, 3.3])
def test_squares_are_marked_about_squares_that_changed(
    shape: tuple[int, int], spread: float
) -> None:
    rng = np.random.default_rng(0)
    then = cv2.GaussianBlur(rng.integers(0, 256, (80, 100), np.uint8), (0, 0), 2)
    change = cv2.GaussianBlur(rng.normal(0, 90, (80, 100)), (0, 0), 3)
    now = np.clip(then + change, 0, 255).astype(np.uint8)
    window = (slice(3, 3 + shape[0]), slice(4, 4 + shape[1]))
    camera = shift(0.4, -0.3)
    found = moving_pixels(now, then, WorldMotion(camera), window, spread)
    assert found.shape == shape
    if not found.size:
        return
    mean = cv2.blur(cv2.absdiff(now[window], warp_window(then, camera, window)), (5, 5))
    expected = cv2.dilate(np.uint8(mean > 6 + 2 * spread), np.ones((5, 5), np.uint8))
    np.testing.assert_array_equal(found, expected)
    if shape == (60, 80):
        assert 0.02 < found.mean() < 0.98


def test_what_moves_is_added_but_not_what_people_have_uncovered() -> None:
    def record(block: int, stamp: int) -> Record:
        image = np.full((80, 100, 3), 120, np.uint8)
        image[30:50, block : block + 10] = 20
        working = WorkingImage.of(image, stamp, (80, 100))
        return Record(working, STILL, BackgroundModel((80, 100)), [WINDOW])

    earlier, now = record(20, 1), record(50, 2)
    people = np.zeros((80, 100), np.uint8)
    add_moving(people, now, [now], 2.0)
    assert not people.any()
    add_moving(people, now, [earlier, now], 2.0)
    assert people[40, 25]
    assert people[40, 55]
    earlier.people = np.zeros((80, 100), np.uint8)
    earlier.people[25:55, 15:35] = 1
    people[:] = 0
    add_moving(people, now, [earlier, now], 2.0)
    assert not people[40, 25]
    assert people[40, 55]


def test_the_world_is_carried_from_three_frames_before() -> None:
    world = np.random.default_rng(0).integers(0, 255, (80, 160, 3)).astype(np.uint8)
    records, left = [], 20
    for number, step in enumerate((9, 1, 2, 4, 3)):
        left += step
        image = WorkingImage.of(world[:, left : left + 100], number, (80, 100))
        motion = WorldMotion(shift(-step))
        records.append(Record(image, motion, BackgroundModel((80, 100)), [WINDOW]))
    people = np.zeros((80, 100), np.uint8)
    add_moving(people, records[4], records, 2.0)
    assert not people.any()
