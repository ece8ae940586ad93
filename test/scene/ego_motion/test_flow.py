# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.scene.ego_motion.flow import camera_motion, corners_of, followed
from gait_segmentation.scene.ego_motion.pyramid import Pyramid


def waves(dx: float, dy: float, shape: tuple[int, int] = (60, 80)) -> Pyramid:
    y, x = np.mgrid[: shape[0], : shape[1]]
    return Pyramid((128 + 60 * np.sin((x - dx) / 5) * np.sin((y - dy) / 4)).astype(np.uint8))


def test_corners_are_apart_and_the_strongest_comes_first() -> None:
    gray, where = np.zeros((40, 60), np.uint8), np.full((40, 60), 255, np.uint8)
    for value, (left, top) in zip(
        (250, 150, 200, 90), [(5, 5), (15, 5), (40, 30), (15, 25)], strict=True
    ):
        gray[top : top + 3, left : left + 3] = value
    where[30:33] = 0
    found = corners_of(gray, where, 6, 9)
    np.testing.assert_array_equal(found, [(6.5, 6.5), (16.5, 6.5), (16.5, 26.5)])
    np.testing.assert_array_equal(corners_of(gray, where, 11, 9), found[[0, 2]])
    np.testing.assert_array_equal(corners_of(gray, where, 6, 1), found[:1])
    strength = cv2.cornerMinEigenVal(gray, 3)
    assert len(corners_of(gray, where, 6, 9, float(strength[6, 16]) - 1e-6)) == 2


@pytest.mark.parametrize('shape', [(0, 0), (1, 1), (2, 9), (40, 60)])
def test_what_is_plain_or_not_to_be_used_has_no_corners(shape: tuple[int, int]) -> None:
    assert len(corners_of(np.full(shape, 90, np.uint8), np.ones(shape, np.uint8), 6, 9)) == 0
    noise = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
    assert len(corners_of(noise, np.zeros(shape, np.uint8), 6, 9)) == 0


@pytest.mark.parametrize('levels', [range(1), range(3), range(1, 3)])
def test_points_are_followed_to_a_part_of_a_pixel(levels: range) -> None:
    # Also in the corner of the image, beyond whose border OpenCV goes on with its mirror image.
    points = np.float32([(30.5, 30.5), (50.5, 24.5), (75.5, 57.5)])
    before, after = followed(waves(0, 0), waves(1.5, -0.75), points, levels)
    np.testing.assert_array_equal(before, points)
    np.testing.assert_allclose((after - before)[:2], [(1.5, -0.75)] * 2, atol=0.05)
    assert after[2] - before[2] == pytest.approx((1.5, -0.75), abs=0.5)


def test_far_points_are_found_about_where_they_are_expected() -> None:
    small = np.random.default_rng(0).integers(0, 255, (12, 16)).astype(np.uint8)
    image = cv2.resize(small, (160, 120), interpolation=cv2.INTER_CUBIC)
    last, now = Pyramid(image[:, 40:].copy()), Pyramid(image[:, :120].copy())
    points = np.float32([(30.5, 30.5), (50.5, 84.5)])
    before, after = followed(last, now, points, range(1), (38.0, 1.0))
    np.testing.assert_allclose(after - before, [(40, 0)] * 2, atol=0.1)


def test_what_is_not_there_is_not_found() -> None:
    none, _ = followed(waves(0, 0), waves(1, 0), np.empty((0, 2), np.float32), range(3))
    assert len(none) == 0
    flat = Pyramid(np.full((60, 80), 90, np.uint8))
    assert len(followed(flat, flat, np.float32([(30.5, 30.5)]), range(3))[0]) == 0
    away = np.float32([(-40, 30), (30, 500), (1e9, 1e9), (np.nan, 5)])
    assert len(followed(waves(0, 0), waves(1, 0), away, range(3))[0]) == 0
    inside = np.float32([(30.5, 30.5)])
    assert len(followed(waves(0, 0), waves(1, 0), inside, range(3), (500.0, 0.0))[0]) == 0


@pytest.mark.parametrize('shape', [(1, 1), (5, 2), (17, 40)])
def test_images_may_be_smaller_than_the_window(shape: tuple[int, int]) -> None:
    points = np.float32([(0.5, 0.5)])
    before, after = followed(waves(0, 0, shape), waves(0, 0, shape), points, range(5))
    np.testing.assert_allclose(before, after, atol=0.1)


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


def test_points_that_do_not_come_back_are_left_out() -> None:
    small = np.random.default_rng(0).integers(0, 255, (14, 22)).astype(np.uint8)
    image = cv2.resize(small, (110, 70), interpolation=cv2.INTER_CUBIC)
    last, now = image[:, 4:].copy(), image[:, :-4].copy()
    # What was there has gone, and something else is in its place.
    now[20:50, 60:100] = np.random.default_rng(1).integers(0, 255, (30, 40))
    kept = np.float32([(x + 0.5, y + 0.5) for x in range(14, 44, 6) for y in range(16, 54, 6)])
    gone = np.float32([(x + 0.5, y + 0.5) for x in range(64, 94, 6) for y in range(24, 48, 6)])
    pair, levels, step = (Pyramid(last), Pyramid(now)), range(2), (4.0, 0.0)
    assert len(followed(*pair, gone, levels, step)[0]) == len(gone)
    assert len(followed(*pair, gone, levels, step, astray=1.0)[0]) < len(gone) / 3
    before, after = followed(*pair, kept, levels, step, astray=1.0)
    np.testing.assert_array_equal(before, kept)
    np.testing.assert_allclose(after - before, np.broadcast_to(step, kept.shape), atol=0.1)
