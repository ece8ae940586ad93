# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.light import Contrast, Light
from gait_segmentation.scene.working import WorkingImage
from gait_segmentation.scene.world_motion import WorldMotion
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.records import Record, moving_pixels
from gait_segmentation.tracking.world import World, windows_about
from test.tracking.figures import wall

SOURCE = (180, 320)
STILL = WorldMotion()


def world(height: float = 120.0, **changes) -> World:
    return World(SOURCE, height, TrackingConfig(**changes))


def learnt(made: World, people: np.ndarray | None = None, margins=(), **options) -> Record:
    """Learn the newest frame, in which nobody is if nobody is given; return it."""
    _, record = made.take(made.now.image.stamp_ns)
    made.learn(
        record, np.zeros(made.shape, np.uint8) if people is None else people, margins, **options
    )
    return record


@pytest.mark.parametrize('everywhere', [False, True])
def test_the_background_is_learnt_about_people_or_everywhere(everywhere: bool) -> None:
    made, area = world(), (Box(20, 40, 30, 100),)
    made.advance(wall(), 10**7, area, camera=True, everywhere=everywhere)
    learnt(made, margins=[(slice(0, 50), slice(0, 50))])
    made.advance(wall(), 2 * 10**7, (), camera=True)
    count = made.now.background.count
    assert count[60, 30] > 0
    assert (count > 0).all() == (count[60, 300] > 0) == everywhere


def shown(made: World, image: np.ndarray, stamp_ns: int) -> bool:
    """Take in a frame and learn it; return whether it was taken for one that shows nothing."""
    made.advance(image, stamp_ns, (), camera=True)
    return learnt(made).blank


def test_noise_is_no_frame_of_a_known_place_and_another_place_from_now_on_is_believed() -> None:
    made, rng = world(), np.random.default_rng(0)
    for number in range(1, 5):
        assert not shown(made, wall(), number)
    before = made.now.background.mean.copy()
    for number in range(5, 8):
        assert shown(made, rng.integers(0, 256, wall().shape).astype(np.uint8), number)
    assert not shown(made, wall(), 8)
    np.testing.assert_allclose(made.now.background.mean, before, atol=0.5)
    blocks = rng.integers(0, 256, (6, 10, 3)).astype(np.uint8)
    other = cv2.resize(blocks, SOURCE[::-1], interpolation=cv2.INTER_NEAREST)
    assert shown(made, other, 9)
    assert not shown(made, other, 10)
    assert np.abs(made.now.background.mean - made.now.image.lab).max() < 1


@pytest.mark.parametrize('gate', [True, False])
def test_what_drives_past_is_not_learnt_as_background(gate: bool) -> None:
    made, scene = world(), wall()
    rng = np.random.default_rng(1)
    car = rng.integers(0, 255, (30, 60, 3)).astype(np.uint8)
    for number in range(6):
        image = scene.copy()
        image[100:130, 20 + 12 * number : 80 + 12 * number] = car
        made.advance(image, (number + 1) * 10**7, (), camera=False)
        learnt(made, margins=[(slice(0, 180), slice(0, 320))], gate=gate)
    made.advance(scene, 10**9, (), camera=False)
    count = made.now.background.count
    passed, beside = count[105:125, 100:130].mean(), count[20:60, 200:300].mean()
    assert beside == pytest.approx(6)
    assert (passed < 4) == gate


def test_what_a_person_uncovers_is_learnt_at_once() -> None:
    made, scene = world(), wall()
    cloth = np.random.default_rng(1).integers(0, 255, (80, 30, 3)).astype(np.uint8)
    for number in range(7):
        image, people = scene.copy(), np.zeros(made.shape, np.uint8)
        columns = slice(40 + 12 * number, 70 + 12 * number)
        image[60:140, columns], people[60:140, columns] = cloth, 255
        made.advance(image, (number + 1) * 10**7, (), camera=False)
        learnt(made, people, [(slice(0, 180), slice(0, 320))])
    made.advance(scene, 10**9, (), camera=False)
    # Two frames before the person came and two since; one counts as motion all the same, where
    # the person's border was.
    assert made.now.background.count[70:130, 90:98].min() == pytest.approx(3, abs=0.1)


def test_what_was_remembered_is_known_in_all_frames_that_wait() -> None:
    made = world()
    for number in range(3):
        left = 20 * number
        image = np.ascontiguousarray(np.pad(wall(), ((0, 0), (0, 60), (0, 0)), mode='wrap'))
        part = np.ascontiguousarray(image[:, left : left + wall().shape[1]])
        made.advance(part, (number + 1) * 10**7, (), camera=True)
    window = (slice(40, 80), slice(100, 160))
    known = BackgroundModel(made.shape)
    known.sums[window][..., :3] = 6.0 * made.now.image.lab[window]
    known.sums[window][..., 3] = 6
    made.adopt(known)
    assert (made.now.background.count[window] == 6).all()
    made.take(3 * 10**7)
    made.advance(part, 4 * 10**7, (), camera=True)
    assert made.now.background.count[45:75, 110:150].min() > 3
    assert made.now.background.mean[60, 130] == pytest.approx(made.now.image.lab[60, 130], abs=2)


def test_a_world_sees_as_another_did() -> None:
    made, light, contrast = world(), Light(), Contrast()
    dark = cv2.convertScaleAbs(wall(), alpha=0.7)
    for image in (wall(), dark):
        seen = WorkingImage.of(image, 10**7, SOURCE, light, contrast)
        light.follow(STILL, np.zeros(SOURCE, np.uint8))
    made.see_as(light, contrast)
    made.advance(dark, 2 * 10**7, (), camera=False)
    np.testing.assert_array_equal(made.now.image.bgr, seen.bgr)


def test_levels_stay_as_they_are_if_that_is_asked_for() -> None:
    off = {'use_light': False, 'use_contrast': False}
    for switches in (off, off | {'use_light': True}, off | {'use_contrast': True}):
        made = world(**switches)
        for number in (1, 2):
            image = cv2.convertScaleAbs(wall(), alpha=0.5 / number)
            made.advance(image, number, (), camera=False)
        assert np.array_equal(made.now.image.bgr, image) == (switches is off)


@pytest.mark.parametrize('texture', [False, True])
def test_a_place_that_loses_its_colours_is_known_all_the_same(texture: bool) -> None:
    made, nobody = world(), np.zeros(world().shape, np.uint8)
    coloured = cv2.convertScaleAbs(wall() * np.array([1.0, 0.8, 0.6]))
    gray = cv2.cvtColor(cv2.cvtColor(coloured, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    for number in range(1, 7):
        image = coloured if number < 5 else gray
        made.advance(image, number, (), camera=False, texture=texture)
        assert made.fades == (number == 5)
        assert not made.now.blank
        background, lab = made.now.background, made.now.image.lab
        if number > 3:
            assert background.agreement(lab, nobody, made.now.windows) > 0.95
        learnt(made)


@pytest.mark.parametrize('frames', [1, 3])
def test_what_is_forgotten_stays_so(frames: int) -> None:
    made, wide = world(), np.concatenate([wall(), wall()], axis=1)
    # The camera goes on by 2 pixels a frame, of which the first is learnt.
    for number in range(frames + 1):
        part = np.ascontiguousarray(wide[:, 2 * number : 2 * number + SOURCE[1]])
        made.advance(part, number + 1, (), camera=True)
        if number == 0:
            learnt(made)
    where = np.zeros(made.shape, np.uint8)
    where[50:90, 100:160] = 255
    made.clear(where)
    assert (made.now.background.count[where > 0] == 0).all()
    for stamp in range(2, frames + 2):
        made.take(stamp)
    made.advance(np.ascontiguousarray(wall()), frames + 2, (), camera=False)
    # Each step shifts by 2 pixels and blurs over 2.
    assert (made.now.background.count[56:84, 112:140] == 0).all()
    assert made.now.background.count[100:150, 110:150].min() > 0.9


SIZE = (120, 300)


def test_windows_have_room_about_people_and_those_who_are_near_share_one() -> None:
    (one,) = windows_about([Box(100, 30, 30, 50)], STILL, SIZE)
    assert one[0].start < 30 < 80 < one[0].stop
    assert one[1].start < 100 < 130 < one[1].stop
    (two,) = windows_about([Box(100, 30, 30, 50)], shift(20), SIZE)
    assert two == (one[0], slice(one[1].start + 20, one[1].stop + 20))
    near = [Box(40, 30, 30, 50), Box(75, 30, 30, 50), Box(220, 30, 30, 50)]
    first, second = windows_about(near, STILL, SIZE)
    assert first[1].stop <= second[1].start
    # Without people it is all of the image, and without those in the image nothing.
    assert windows_about([], STILL, SIZE) == [(slice(0, 120), slice(0, 300))]
    assert windows_about([Box(400, 30, 30, 50)], STILL, SIZE) == []


def shift(dx: float, dy: float = 0.0) -> WorldMotion:
    return WorldMotion(np.array([[1.0, 0.0, dx], [0.0, 1.0, dy], [0.0, 0.0, 1.0]]))


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
    found = moving_pixels(now, then, camera, window, spread)
    assert found.shape == shape
    if not found.size:
        return
    mean = cv2.blur(cv2.absdiff(now[window], camera.warped(then, window)), (5, 5))
    expected = cv2.dilate(np.uint8(mean > 6 + 2 * spread), np.ones((5, 5), np.uint8))
    np.testing.assert_array_equal(found, expected)
    if shape == (60, 80):
        assert 0.02 < found.mean() < 0.98


def test_a_world_fits_people_of_about_its_size() -> None:
    made = world(120.0, working_height=60)
    assert [made.fits(height) for height in (80, 90, 230, 250)] == [False, True, True, False]


def test_of_a_frame_that_shows_nothing_no_background_is_learnt_by_its_motion_or_without() -> None:
    made, noise = world(), np.random.default_rng(0).integers(0, 256, wall().shape, np.uint8)
    for number in range(1, 5):
        shown(made, wall(), number)
    made.advance(noise, 5, (), camera=True)
    assert learnt(made, gate=False).blank
    made.advance(wall(), 6, (), camera=True)
    np.testing.assert_allclose(made.now.background.count, 4, atol=0.1)
