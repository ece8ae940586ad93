# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import pixel_affine
from gait_segmentation.scene.ego_motion.estimator import MotionEstimator
from gait_segmentation.scene.ego_motion.pyramid import Pyramid
from gait_segmentation.scene.ego_motion.world_motion import WorldMotion


def scene(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    small = rng.integers(0, 255, (30, 40)).astype(np.uint8)
    return cv2.resize(small, (320, 240), interpolation=cv2.INTER_CUBIC)


def moved(image: np.ndarray, motion: np.ndarray) -> np.ndarray:
    return cv2.warpAffine(
        image, pixel_affine(motion), image.shape[::-1], borderMode=cv2.BORDER_REFLECT
    )


def test_the_first_frame_has_no_motion() -> None:
    estimator = MotionEstimator()
    motion = estimator.update(Pyramid(scene()), None)
    assert motion == WorldMotion()
    assert estimator.body_shift(np.full((240, 320), 255, np.uint8), motion) is None


def test_a_still_camera_has_no_motion() -> None:
    estimator = MotionEstimator()
    estimator.update(Pyramid(scene()), None)
    assert estimator.update(Pyramid(scene()), None).camera is None


def test_pan_and_zoom_are_found() -> None:
    estimator = MotionEstimator()
    true = np.array([[1.01, 0.0, 4.0], [0.0, 1.01, -2.5]])
    estimator.update(Pyramid(scene()), None)
    camera = estimator.update(Pyramid(moved(scene(), true)), None).camera
    assert camera is not None
    for point in ([50, 50, 1], [250, 180, 1]):
        assert camera @ point == pytest.approx(true @ point, abs=0.15)


def test_a_fast_body_is_followed_from_where_it_is_expected() -> None:
    world, texture = scene(), scene(2)
    texture = np.tile(texture[:, :24], (1, 14))[:, :320]
    person = np.zeros((240, 320), np.uint8)
    person[60:180, 120:180] = 255
    first = np.where(person > 0, texture, world)
    shifted = np.roll(person, 22, axis=1)
    second = np.where(shifted > 0, np.roll(texture, 22, axis=1), world)
    estimator = MotionEstimator()
    estimator.update(Pyramid(first), person)
    estimator.update(Pyramid(second), person)
    # The texture repeats, so that it seems to have gone back a little.
    assert estimator.body_shift(person, WorldMotion()) == pytest.approx((-2, 0), abs=0.3)
    there = estimator.body_shift(person, WorldMotion(), (19.0, 1.0))
    assert there == pytest.approx((22, 0), abs=0.3)
    # Only a part of the image, with the body at its border.
    part = estimator.body_shift(person[60:, 110:180], WorldMotion(), (19.0, 1.0), (60, 110))
    assert part == there


def test_the_body_moves_apart_from_the_world() -> None:
    world = scene()
    person = np.zeros((240, 320), np.uint8)
    person[60:180, 120:180] = 255
    first = np.where(person > 0, scene(2), world)
    shifted = np.roll(person, 6, axis=1)
    second = np.where(shifted > 0, np.roll(scene(2), 6, axis=1), world)
    estimator = MotionEstimator()
    estimator.update(Pyramid(first), person)
    motion = estimator.update(Pyramid(second), person)
    assert motion.camera is None
    assert estimator.body_shift(person, motion) == pytest.approx((6, 0), abs=0.3)


def test_bodies_at_the_border_are_followed_as_well() -> None:
    frames = [Pyramid(np.ascontiguousarray(scene()[:, step : step + 300])) for step in (0, 3)]
    body = np.zeros((240, 300), np.uint8)
    body[150:, 260:] = 255
    estimator = MotionEstimator()
    for frame in frames:
        motion = estimator.update(frame, None)
    assert estimator.body_shift(body, motion) == pytest.approx((-3, 0), abs=0.2)


def test_an_image_without_texture_has_no_motion() -> None:
    estimator = MotionEstimator()
    flat = np.full((240, 320), 90, np.uint8)
    estimator.update(Pyramid(flat), None)
    motion = estimator.update(Pyramid(flat), None)
    assert motion.camera is None
    assert estimator.body_shift(flat, motion) is None


def test_frames_in_which_nothing_can_be_seen_are_passed_over() -> None:
    motion = np.array([[1, 0, 5.0], [0, 1, -2.0]])
    estimator = MotionEstimator()
    estimator.update(Pyramid(scene()), None)
    body = np.full((240, 320), 255, np.uint8)
    for _ in range(3):
        covered = estimator.update(Pyramid(np.full((240, 320), 90, np.uint8)), None)
        assert covered.camera is None
        assert estimator.body_shift(body, covered) is None
    found = estimator.update(Pyramid(moved(scene(), motion)), None)
    np.testing.assert_allclose(found.camera, motion, atol=0.1)


def test_another_size_starts_anew() -> None:
    estimator = MotionEstimator()
    estimator.update(Pyramid(scene()), None)
    assert estimator.update(Pyramid(scene()[:100]), None).camera is None


def test_stripes_and_noise_are_nothing_to_follow() -> None:
    x = np.arange(320, dtype=np.float32)
    stripes = np.repeat((90 + 60 * (np.sin(x * np.pi / 4) > 0))[None], 240, 0)
    rng = np.random.default_rng(0)
    estimator = MotionEstimator()
    body = np.zeros((240, 320), np.uint8)
    body[60:180, 120:180] = 255
    for shift in (0, 2, 4):
        noisy = np.roll(stripes, shift, 1) + rng.normal(0, 2.5, stripes.shape)
        motion = estimator.update(Pyramid(np.clip(noisy, 0, 255).astype(np.uint8)), body)
        assert motion.camera is None


def test_a_jolt_of_40_pixels_is_followed() -> None:
    estimator = MotionEstimator()
    true = np.array([[1.0, 0.0, 40.0], [0.0, 1.0, -12.0]])
    wide = cv2.resize(scene(), (640, 480), interpolation=cv2.INTER_CUBIC)
    body = np.zeros((480, 640), np.uint8)
    body[180:300, 300:350] = 255
    estimator.update(Pyramid(wide), body)
    motion = estimator.update(Pyramid(moved(wide, true)), body)
    assert motion.camera is not None
    assert motion.camera @ [320, 240, 1] == pytest.approx([360, 228], abs=0.3)
    # The body is looked for where the camera's motion takes it.
    assert estimator.body_shift(body, motion) == pytest.approx((40, -12), abs=0.3)


def test_corners_that_see_the_person_are_not_of_the_world() -> None:
    # The only corners are on the person, who moves, and at the border of the person's area.
    flat = np.full((240, 320), 90, np.uint8)
    people = np.zeros((240, 320), np.uint8)
    people[60:180, 120:180] = 255
    estimator = MotionEstimator()
    for step in (0, 5):
        frame = flat.copy()
        frame[60:180, 120 + step : 180 + step] = scene()[60:180, 120:180]
        camera = estimator.update(Pyramid(frame), people).camera
        assert camera is None


def test_points_that_do_not_agree_say_nothing() -> None:
    rng = np.random.default_rng(0)
    estimator = MotionEstimator()
    estimator.update(Pyramid(scene(1)), None)
    other = np.uint8(rng.integers(0, 255, (240, 320)))
    assert estimator.update(Pyramid(other), None).camera is None
