# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.scene.ego_motion import Pyramid, WorldMotion
from gait_segmentation.scene.working import Contrast, Light, WorkingImage, working_scale

SHAPE = (240, 320)
STILL = WorldMotion()
NOBODY = np.zeros(SHAPE, np.uint8)


def scene(seed: int = 1, shape: tuple[int, int] = SHAPE) -> np.ndarray:
    """Return a coloured place, (h, w, 3) uint8."""
    rng = np.random.default_rng(seed)
    small = rng.integers(60, 180, (shape[0] // 20, shape[1] // 20, 3)).astype(np.uint8)
    return cv2.resize(small, shape[::-1], interpolation=cv2.INTER_CUBIC)


def lit(image: np.ndarray, gain: object, noise: int | None = None) -> np.ndarray:
    """Return an image in other light, with noise of 2 levels if it gets a seed."""
    levels = image * np.asarray(gain, np.float32)
    if noise is not None:
        levels += np.random.default_rng(noise).normal(0, 2, image.shape)
    return np.clip(levels + 0.5, 0, 255).astype(np.uint8)


def shown(
    light: Light, image: np.ndarray, motion: WorldMotion = STILL, people: np.ndarray = NOBODY
) -> np.ndarray:
    light.measure(image)
    made = light.undone(image)
    light.follow(motion, people)
    return made


def error(made: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.abs(made.astype(int) - wanted).mean())


@pytest.mark.parametrize('factor', [0.5, 0.8, 1.3])
def test_a_jump_is_undone_and_the_way_back_too(factor: float) -> None:
    light = Light()
    assert shown(light, scene()) is not None
    for _ in range(2):
        assert error(shown(light, lit(scene(), factor)), scene()) < 2.5
        assert light.gain == pytest.approx(1 / factor, rel=0.03)
    assert error(shown(light, scene()), scene()) < 2.5


@pytest.mark.parametrize('last', [(0.7, 0.7, 0.7), (1.12, 1.0, 0.88)])
def test_slow_changes_of_exposure_and_white_balance_are_undone(
    last: tuple[float, float, float],
) -> None:
    light = Light()
    for number in range(35):
        gain = 1 + (np.array(last) - 1) * min(max(number - 15, 0) / 12, 1)
        image = lit(scene(), gain, number)
        made = shown(light, image)
        assert error(made, scene()) < 6, number
        # The same light leaves frames as they are.
        assert number > 15 or made is image
    assert light.gain == pytest.approx(1 / np.array(last), rel=0.06)
    assert light.wave is None


@pytest.mark.parametrize(('width', 'known'), [(0, False), (60, False), (100, True)])
def test_bands_that_wander_are_undone_also_behind_a_person(width: int, known: bool) -> None:
    light, people, columns = Light(), NOBODY.copy(), slice(40, 40 + width)
    people[60:, columns] = 255 if known else 0
    rows = np.arange(SHAPE[0]) / SHAPE[0]
    for number in range(25):
        image, gain = scene(), np.ones((SHAPE[0], 1, 1))
        if number >= 5:
            image[60:, columns] = 70
        if number >= 10:
            gain[:, 0, 0] += 0.15 * np.sin(2 * np.pi * (1.5 * rows + 0.37 * number))
        made = shown(light, lit(image, gain, number), people=people)
        assert (light.wave is not None) == (number >= 10)
        assert error(made, image) < 4
    if width == 0:
        shown(light, scene())
        assert light.wave is None


def test_changes_of_parts_other_pictures_and_moved_ones_are_no_light() -> None:
    darker = scene()
    darker[60:140, :150] //= 2
    parts = lit(scene(), np.repeat([1, 0.75, 0.56], [107, 106, 107])[:, None])
    for image in (darker, parts, np.roll(scene(), 40, axis=1), scene(2)):
        light = Light()
        shown(light, scene())
        shown(light, image)
        assert light.wave is None
        assert light.gain == pytest.approx(1, abs=1e-9 if image is darker else 0.03)
    stripes = np.where(np.arange(320) // 4 % 2, 150, 90).astype(np.uint8)
    image = np.broadcast_to(stripes[None, :, None], (*SHAPE, 3))
    light = Light()
    for step in range(9):
        shown(light, np.ascontiguousarray(np.roll(image, step, axis=1)))
        assert (light.gain == 1).all()


@pytest.mark.parametrize('value', [0, 255])
def test_black_and_white_images_say_nothing(value: int) -> None:
    light = Light()
    shown(light, scene())
    shown(light, lit(scene(), 0.7))
    gain = light.gain.copy()
    shown(light, np.full((*SHAPE, 3), value, np.uint8))
    assert np.array_equal(light.gain, gain)
    assert error(shown(light, lit(scene(), 0.7)), scene()) < 2.5


@pytest.mark.parametrize('width', [0.3, 0.47, 0.7, 1.0])
@pytest.mark.parametrize('known', [False, True])
def test_a_person_who_fills_the_picture_is_no_light(width: float, known: bool) -> None:
    light = Light()
    for number in range(20):
        image, people = lit(scene(), 1, number), NOBODY.copy()
        if number >= 5:
            columns = slice(0, round(width * SHAPE[1] * min((number - 4) / 8, 1)))
            image[:, columns] = lit(np.full_like(image[:, columns], 70), 1, number)
            people[:, columns] = 255 if known else 0
        shown(light, image, people=people)
        if known or width < 0.5:
            assert light.gain == pytest.approx(1, abs=0.03)
    for number in range(20, 24):
        made = shown(light, lit(scene(), 1, number))
    assert error(made, scene()) < 5


def test_the_place_is_known_while_the_camera_moves() -> None:
    wide, light = scene(3, (240, 960)), Light()
    motion = WorldMotion(np.array([[1.0, 0.0, -5.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    for number in range(40):
        part = np.ascontiguousarray(wide[:, 5 * number : 5 * number + 320])
        made = shown(light, lit(part, 1 - 0.01 * number, number), motion if number else STILL)
        assert error(made, part) < 9, number
    assert light.gain == pytest.approx(1 / (1 - 0.01 * 39), rel=0.12)


def test_colours_that_go_are_told_and_leave_no_tint() -> None:
    light = Light()
    warm = lit(scene(), (0.6, 1, 1.2))
    gray = np.repeat(cv2.cvtColor(warm, cv2.COLOR_BGR2GRAY)[..., None], 3, axis=2)
    light.measure(gray, gray=True)
    assert not light.faded
    light = Light()
    shown(light, warm)
    shown(light, lit(warm, (1.1, 1, 0.9)))
    for gain in (1.0, 0.8):
        light.measure(lit(gray, gain), gray=True)
        made = light.undone(lit(gray, gain))
        light.follow(STILL, NOBODY)
        assert light.faded
        assert np.ptp(made.astype(int), axis=2).max() <= 1
        assert error(made, gray) < 4
    # Nor where nothing tells the light.
    light = Light()
    shown(light, warm)
    shown(light, lit(warm, (1.1, 1, 0.9)))
    other = np.repeat(cv2.cvtColor(scene(2), cv2.COLOR_BGR2GRAY)[..., None], 3, axis=2)
    light.measure(other, gray=True)
    assert np.ptp(light.undone(other).astype(int), axis=2).max() <= 1
    made = shown(light, warm)
    assert not light.faded
    assert error(made, warm) < 4


def picture(low: int, high: int) -> np.ndarray:
    return np.random.default_rng(1).integers(low, high + 1, (60, 80, 3)).astype(np.uint8)


def test_levels_that_count_are_spread_evenly_and_the_rest_keeps_its_shares() -> None:
    few = np.repeat(np.arange(100, 141, dtype=np.uint8), 9).reshape(-1, 9, 1)
    curve = Contrast().curve_for(few)
    # 40 levels become 128; of the 127 left 100 / 215 lie below.
    expected = 127 * 100 / 215 + 3.2 * np.arange(41)
    assert curve[100:141] == pytest.approx(expected, abs=0.51)
    assert curve[50] == pytest.approx(127 * 50 / 215, abs=0.51)


@pytest.mark.parametrize(('low', 'high'), [(0, 255), (20, 230), (50, 185)])
def test_pictures_of_many_levels_stay_and_the_first_decides_for_all(low: int, high: int) -> None:
    contrast, few, many = Contrast(), picture(60, 120), picture(low, high)
    first = contrast.curve_for(few)
    assert first is not None
    assert contrast.curve_for(many) is first
    contrast = Contrast()
    assert contrast.curve_for(many) is contrast.curve_for(few) is None


def test_tall_people_are_scaled_down_and_small_ones_never_up() -> None:
    sizes = {'working_size': 640, 'working_height': 160}
    assert working_scale(480, 640, person_height=320, **sizes) == pytest.approx(0.5)
    assert working_scale(480, 640, person_height=50, **sizes) == 1
    assert working_scale(1080, 1920, person_height=50, **sizes) == pytest.approx(1 / 3)
    assert working_scale(1080, 1920, person_height=50, working_size=0, working_height=160) == 1


def test_a_jump_of_the_exposure_is_undone_before_levels_are_spread() -> None:
    image = np.random.default_rng(0).integers(60, 130, (240, 320, 3)).astype(np.uint8)
    image = cv2.blur(image, (5, 5))
    light, contrast, made = Light(), Contrast(), []
    for gain in (1.0, 1.5):
        bright = cv2.convertScaleAbs(image, alpha=gain)
        made.append(WorkingImage.of(bright, 3, (240, 320), light, contrast))
        light.follow(WorldMotion(), np.zeros((240, 320), np.uint8))
    assert np.ptp(made[0].gray) > 1.5 * np.ptp(image)
    assert np.abs(made[1].gray.astype(int) - made[0].gray).mean() < 2


@pytest.mark.parametrize('texture', [False, True])
def test_a_grey_frame_shows_texture_and_tells_that_it_has_lost_its_colours(texture: bool) -> None:
    image = np.random.default_rng(2).integers(0, 255, (40, 60, 3)).astype(np.uint8)
    gray = cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    light = Light()
    assert not WorkingImage.of(image, 3, (40, 60), light).faded
    frame = WorkingImage.of(gray, 4, (40, 60), light, texture=texture)
    assert frame.faded
    assert not WorkingImage.of(gray, 4, (40, 60), Light()).faded
    assert frame.textured == (len(np.unique(frame.lab[..., 1])) > 5) == texture
    assert texture or (frame.lab[..., 1:] == 128).all()
    window = slice(3, 40, 2), slice(0, 60, 2)
    assert np.array_equal(frame.lab_part(window), frame.lab[window])
    assert frame.lab_part(window).flags.c_contiguous


def test_noise_alone_is_blank_and_one_small_person_is_not() -> None:
    noise = np.random.default_rng(0).normal(90, 4, (480, 640))
    assert Pyramid(np.clip(noise, 0, 255).astype(np.uint8)).is_blank
    noise[200:220, 300:308] = 150
    assert not Pyramid(np.clip(noise, 0, 255).astype(np.uint8)).is_blank
