# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.scene.ego_motion import (
    MotionEstimator,
    Pyramid,
    WorldMotion,
    camera_motion,
    followed,
)


def scene(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    small = rng.integers(0, 255, (30, 40)).astype(np.uint8)
    return cv2.resize(small, (320, 240), interpolation=cv2.INTER_CUBIC)


NOBODY = np.zeros((240, 320), np.uint8)


def motion_of(*rows: list[float]) -> WorldMotion:
    return WorldMotion(np.array(rows if len(rows) == 3 else [*rows, [0, 0, 1]], np.float64))


def moved(image: np.ndarray, motion: WorldMotion) -> np.ndarray:
    whole = slice(0, image.shape[0]), slice(0, image.shape[1])
    return motion.warped(image, whole, cv2.BORDER_REFLECT)


@pytest.mark.parametrize('tilt', [0.0, 1.5e-4])
def test_how_the_camera_pans_zooms_and_tilts_is_found(tilt: float) -> None:
    estimator = MotionEstimator()
    true = motion_of([1.01, 0.0, 4.0], [0.0, 1.01, -2.5], [0.0, tilt, 1.0])
    estimator.update(Pyramid(scene()), NOBODY)
    found = estimator.update(Pyramid(moved(scene(), true)), NOBODY)
    for point in ((50, 50), (250, 180), (20, 220)):
        assert found.carry(*point) == pytest.approx(true.carry(*point), abs=0.15)


PERSON = NOBODY.copy()
PERSON[60:180, 120:180] = 255


def stepping(texture: np.ndarray, step: int) -> tuple[MotionEstimator, WorldMotion]:
    """Return an estimator that has seen a body step to the right before a world that stands."""
    estimator = MotionEstimator()
    for shift in (0, step):
        there, cloth = (np.roll(each, shift, axis=1) for each in (PERSON, texture))
        motion = estimator.update(Pyramid(np.where(there > 0, cloth, scene())), PERSON)
    return estimator, motion


def test_the_body_moves_apart_from_the_world() -> None:
    estimator, motion = stepping(scene(2), 6)
    assert motion.camera is None
    assert estimator.body_shift(PERSON, motion) == pytest.approx((6, 0), abs=0.3)


def test_a_fast_body_is_followed_from_where_it_is_expected() -> None:
    estimator, _ = stepping(np.tile(scene(2)[:, :24], (1, 14))[:, :320], 22)
    # The texture repeats, so that it seems to have gone back a little.
    assert estimator.body_shift(PERSON, WorldMotion()) == pytest.approx((-2, 0), abs=0.3)
    there = estimator.body_shift(PERSON, WorldMotion(), (19.0, 1.0))
    assert there == pytest.approx((22, 0), abs=0.3)
    # Only a part of the image, with the body at its border.
    part = estimator.body_shift(PERSON[60:, 110:180], WorldMotion(), (19.0, 1.0), (60, 110))
    assert part == there


def test_frames_in_which_nothing_can_be_seen_are_passed_over() -> None:
    motion = motion_of([1, 0, 5], [0, 1, -2])
    estimator = MotionEstimator()
    estimator.update(Pyramid(scene()), NOBODY)
    body = np.full((240, 320), 255, np.uint8)
    for _ in range(3):
        covered = estimator.update(Pyramid(np.full((240, 320), 90, np.uint8)), NOBODY)
        assert covered.camera is None
        assert estimator.body_shift(body, covered) is None
    found = estimator.update(Pyramid(moved(scene(), motion)), NOBODY)
    assert found.carry(160, 120) == pytest.approx((165, 118), abs=0.1)


@pytest.mark.parametrize('what', ['stripes', 'slope', 'smaller'])
def test_stripes_noise_and_another_size_are_nothing_to_follow(what: str) -> None:
    y, x = np.mgrid[:240, :320].astype(np.float32)
    still = 60 + 100 * y / 239 if what == 'slope' else 90 + 60 * (np.sin(x * np.pi / 4) > 0)
    noise, estimator = np.random.default_rng(0).normal(0, 2.5, (240, 320)), MotionEstimator()
    for shift in (0, 2, 4):
        frame = np.clip(np.roll(still + noise, shift, 1), 0, 255).astype(np.uint8)
        if what == 'smaller':
            frame = scene()[: 240 - 10 * shift]
        assert estimator.update(Pyramid(frame), PERSON).camera is None


def test_a_jolt_of_40_pixels_is_followed() -> None:
    estimator = MotionEstimator()
    true = motion_of([1, 0, 40], [0, 1, -12])
    wide = cv2.resize(scene(), (640, 480), interpolation=cv2.INTER_CUBIC)
    body = np.zeros((480, 640), np.uint8)
    body[180:300, 300:350] = 255
    estimator.update(Pyramid(wide), body)
    motion = estimator.update(Pyramid(moved(wide, true)), body)
    assert motion.carry(320, 240) == pytest.approx((360, 228), abs=0.3)
    # The body is looked for where the camera's motion takes it.
    assert estimator.body_shift(body, motion) == pytest.approx((40, -12), abs=0.3)


def waves(dx: float, dy: float, shape: tuple[int, int] = (60, 80)) -> Pyramid:
    y, x = np.mgrid[: shape[0], : shape[1]]
    return Pyramid((128 + 60 * np.sin((x - dx) / 5) * np.sin((y - dy) / 4)).astype(np.uint8))


@pytest.mark.parametrize('levels', [range(1), range(3), range(1, 3)])
def test_points_are_followed_to_a_part_of_a_pixel(levels: range) -> None:
    # Also in the corner of the image, beyond whose border OpenCV goes on with its mirror image.
    points = np.float32([(30.5, 30.5), (50.5, 24.5), (75.5, 57.5)])
    after, found = followed(waves(0, 0), waves(1.5, -0.75), points, levels)
    assert found.all()
    np.testing.assert_allclose((after - points)[:2], [(1.5, -0.75)] * 2, atol=0.05)
    assert after[2] - points[2] == pytest.approx((1.5, -0.75), abs=0.5)


TRUE = motion_of([1.02, -0.03, 4], [0.03, 1.02, -7], [1e-5, -2e-5, 1])


def points() -> np.ndarray:
    return np.random.default_rng(2).uniform((0, 0), (320, 240), (40, 2)).astype(np.float32)


def test_points_that_stand_still_are_few_turn_far_or_do_not_agree_have_no_motion() -> None:
    carried = np.array([TRUE.carry(*point) for point in points().tolist()], np.float32)
    turned = [
        cv2.transform(points()[None], cv2.getRotationMatrix2D((160, 120), angle, 1.0))[0]
        for angle in (10.0, 13.0)
    ]
    assert camera_motion(points(), carried) is not None
    assert camera_motion(points()[:7], carried[:7]) is None
    assert camera_motion(points(), turned[0]) is not None
    for after in (points(), points() + np.float32(0.1), carried[::-1], turned[1]):
        assert camera_motion(points(), after) is None


STEP, TURN = motion_of([1, 0, 3], [0, 1, 0]), motion_of([0, -1, 0], [1, 0, 0])


def test_motions_of_the_camera_are_made_one_after_the_other() -> None:
    still = WorldMotion()
    total = WorldMotion.over([still, TURN, still, STEP])
    assert total.carry(5, 1) == pytest.approx((2, 5))
    for nothing in (WorldMotion.over([still, still]), WorldMotion.over([])):
        assert nothing.camera is None
        assert nothing.carry(5, 1) == (5, 1)


@pytest.mark.parametrize(
    'motion',
    [
        motion_of([1, 0, 3.3], [0, 1, -1.77]),
        motion_of([0.9, 0.1, 3], [-0.1, 0.9, 4], [1e-4, 2e-4, 1]),
    ],
)
def test_what_a_window_shows_is_where_the_motion_takes_it(motion: WorldMotion) -> None:
    window, (y, x) = np.s_[20:60, 30:110], np.mgrid[20:60, 30:110] + 0.5
    for point in ((65.5, 35.5), (80.5, 45.5)):
        dot = np.zeros((90, 130), np.float32)
        dot[int(point[1]), int(point[0])] = 1
        part = motion.warped(cv2.GaussianBlur(dot, (0, 0), 2), window)
        center = (x * part).sum() / part.sum(), (y * part).sum() / part.sum()
        assert center == pytest.approx(motion.carry(*point), abs=0.1)
