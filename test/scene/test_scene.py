# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.ego_motion import WorldMotion
from gait_segmentation.scene.scene import (
    Frame,
    Regions,
    Scene,
    SceneOptions,
    View,
    WholeView,
    moving_pixels,
    windows_about,
)
from test.tracking.figures import wall

SOURCE = (180, 320)
STILL = WorldMotion()
NOBODY = np.zeros(SOURCE, np.uint8)


class Place:
    """A scene with one view at the size of the source, shown one image after the other."""

    def __init__(self) -> None:
        self.scene, self.view, self.stamp_ns = Scene(SOURCE), View(SOURCE, 1.0), 0
        self.where = Regions()

    def show(self, image: np.ndarray, *, camera: bool = True, texture: bool = True) -> Frame:
        """Take in a frame."""
        self.stamp_ns += 10**7
        options = SceneOptions(camera, texture)
        self.scene.advance(image, self.stamp_ns, {self.view: self.where}, options=options)
        if not self.scene.views:
            self.scene.add(self.view)
        return self.view.now

    def learn(self, people: np.ndarray = NOBODY, margins=(), back: int = 0, **options) -> Frame:
        """Learn the newest frame, or one that is some frames back; return it."""
        frame = self.view.take(self.stamp_ns - back * 10**7)
        self.view.add_background(frame, people, margins, **options)
        return frame

    def see(self, image: np.ndarray) -> bool:
        """Take in a frame and learn it; return whether it was taken for one that shows nothing."""
        self.show(image)
        return self.learn().blank


@pytest.mark.parametrize('everywhere', [False, True])
def test_the_background_is_learnt_about_people_or_everywhere(everywhere: bool) -> None:
    made = Place()
    made.show(wall())
    made.where = Regions((Box(20, 40, 30, 100),), everywhere)
    made.show(wall())
    made.learn(margins=[(slice(0, 50), slice(0, 50))])
    count = made.view.background.count
    assert count[60, 30] > 0
    assert (count > 0).all() == (count[60, 300] > 0) == everywhere


def test_noise_is_no_frame_of_a_known_place_and_another_place_from_now_on_is_believed() -> None:
    made, rng = Place(), np.random.default_rng(0)
    for _ in range(4):
        assert not made.see(wall())
    before = made.view.background.mean.copy()
    for gate in (True, False, True):
        made.show(rng.integers(0, 256, wall().shape).astype(np.uint8))
        assert made.learn(gate=gate).blank
        np.testing.assert_allclose(made.view.background.count, 4, atol=0.1)
    assert not made.see(wall())
    np.testing.assert_allclose(made.view.background.mean, before, atol=0.5)
    blocks = rng.integers(0, 256, (6, 10, 3)).astype(np.uint8)
    other = cv2.resize(blocks, SOURCE[::-1], interpolation=cv2.INTER_NEAREST)
    assert made.see(other)
    assert not made.see(other)
    assert np.abs(made.view.background.mean - made.view.now.image.lab).max() < 1


@pytest.mark.parametrize('gate', [True, False])
def test_what_drives_past_is_not_learnt_as_background(gate: bool) -> None:
    made, place = Place(), wall()
    rng = np.random.default_rng(1)
    car = rng.integers(0, 255, (30, 60, 3)).astype(np.uint8)
    for number in range(6):
        image = place.copy()
        image[100:130, 20 + 12 * number : 80 + 12 * number] = car
        made.show(image, camera=False)
        made.learn(margins=[(slice(0, 180), slice(0, 320))], gate=gate)
    made.show(place, camera=False)
    count = made.view.background.count
    passed, beside = count[105:125, 100:130].mean(), count[20:60, 200:300].mean()
    assert beside == pytest.approx(6)
    assert (passed < 4) == gate


def test_what_a_person_uncovers_is_learnt_at_once() -> None:
    made, place = Place(), wall()
    cloth = np.random.default_rng(1).integers(0, 255, (80, 30, 3)).astype(np.uint8)
    for number in range(7):
        image, people = place.copy(), NOBODY.copy()
        columns = slice(40 + 12 * number, 70 + 12 * number)
        image[60:140, columns], people[60:140, columns] = cloth, 255
        made.show(image, camera=False)
        made.learn(people, [(slice(0, 180), slice(0, 320))])
    # Two frames before the person came and two since; one counts as motion all the same, where
    # the person's border was.
    assert made.view.background.count[70:130, 90:98].min() == pytest.approx(3, abs=0.1)


def test_levels_stay_as_they_are_if_that_is_asked_for() -> None:
    off = SceneOptions(light=False, contrast=False)
    for options in (off, replace(off, light=True), replace(off, contrast=True)):
        made = Scene(SOURCE)
        for number in (1, 2):
            image = cv2.convertScaleAbs(wall(), alpha=0.5 / number)
            made.advance(image, number, options=options)
            if number == 1:
                made.add(View(SOURCE, 1.0))
        assert np.array_equal(made.views[0].now.image.bgr, image) == (options is off)


@pytest.mark.parametrize('texture', [False, True])
def test_a_place_that_loses_its_colours_is_known_all_the_same(texture: bool) -> None:
    made = Place()
    coloured = cv2.convertScaleAbs(wall() * np.array([1.0, 0.8, 0.6]))
    gray = cv2.cvtColor(cv2.cvtColor(coloured, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    for number in range(1, 7):
        frame = made.show(coloured if number < 5 else gray, camera=False, texture=texture)
        assert made.scene.fades == (number == 5)
        assert not frame.blank
        if number > 3:
            lab, windows = frame.image.lab, frame.windows
            assert made.view.background.agreement(lab, NOBODY, windows) > 0.95
        made.learn()


@pytest.mark.parametrize('late', [0, 3])
@pytest.mark.parametrize('pan', [0, 2])
def test_a_frame_is_learnt_where_the_background_is_by_now(pan: int, late: int) -> None:
    made, wide = Place(), np.concatenate([wall(), wall()], axis=1)
    person = NOBODY.copy()
    person[50:130, 100:130] = 255
    for number in range(12):
        frame = made.show(np.ascontiguousarray(wide[:, pan * number :][:, : SOURCE[1]]))
        if number >= late:
            made.learn(np.roll(person, -pan * (number - late), 1), back=late)
    background, window = made.view.background, (slice(20, 160), slice(10, 250))
    known = background.count[window] > 1
    hidden = np.roll(person, -pan * 11, 1)[window] > 0
    assert not known[hidden].any()
    assert known[~cv2.dilate(np.uint8(hidden), np.ones((13, 13))).astype(bool)].all()
    difference = np.abs(background.mean[window] - frame.image.lab[window])[known]
    assert difference.mean() < (3 if pan else 1)


def test_a_frame_is_learnt_once_and_none_before_it() -> None:
    made = Place()
    for _ in range(4):
        made.show(wall())
    assert made.view.take(3 * 10**7) is not None
    assert made.view.take(3 * 10**7) is None
    assert made.view.take(2 * 10**7) is None
    assert made.view.take(4 * 10**7) is not None
    assert made.view.take(10**9) is None


def test_all_views_have_the_light_and_the_motion_of_the_finest() -> None:
    def views(gain: float) -> list[View]:
        """Return a coarse and a fine view of a place that a camera pans over in changing light."""
        scene, made = Scene(SOURCE), [View(SOURCE, 0.5), View(SOURCE, 1.0)]
        wide = np.concatenate([wall(), wall()], axis=1)
        for number in range(8):
            part = np.ascontiguousarray(wide[:, 4 * number :][:, : SOURCE[1]])
            scene.advance(
                cv2.convertScaleAbs(part, alpha=gain if number >= 4 else 1.0), 1 + number
            )
            for view in made if number == 0 else ():
                scene.add(view)
        return made

    for dark, plain in zip(views(0.7), views(1.0), strict=True):
        assert np.abs(dark.now.image.bgr.astype(int) - plain.now.image.bgr).mean() < 4
        x, y = dark.now.motion.carry(80.0, 40.0)
        assert (x - 80, y - 40) == pytest.approx((-4.0 * dark.scale, 0.0), abs=0.1)


def test_people_of_a_coarse_view_are_no_world_to_the_finest() -> None:
    scene, fine, coarse = Scene(SOURCE), View(SOURCE, 1.0), View(SOURCE, 0.5)
    person, people = Box(150, 30, 100, 130), {}
    for number in range(3):
        image = np.full((*SOURCE, 3), 90, np.uint8)
        body = person.shifted(3 * number, 0)
        window = body.slices(SOURCE[1], SOURCE[0])
        image[window] = wall()[person.slices(SOURCE[1], SOURCE[0])]
        scene.advance(image, 1 + number, people)
        for view in (fine, coarse) if number == 0 else ():
            scene.add(view)
        people = {coarse: Regions((body.scaled(0.5),))}
        assert fine.now.motion.camera is None


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


def test_squares_are_marked_about_squares_that_changed() -> None:
    then = np.full((40, 60), 100, np.uint8)
    now = then.copy()
    now[10:20, 20:30] = 113
    found = moving_pixels(now, then, 3.3)
    # Means of 5 x 5 pixels are above 12.6 in the middle only, about which 5 x 5 are marked.
    expected = np.zeros_like(found)
    expected[10:20, 20:30] = 1
    np.testing.assert_array_equal(found, expected)
    assert not moving_pixels(now, then, 3.6).any()
    assert moving_pixels(now[:0], then[:0], 3.3).shape == (0, 60)


@pytest.mark.parametrize(('back', 'age'), [(0, 0), (1, 1), (4, 4), (5, None)])
def test_a_heat_map_counts_in_the_frame_that_it_is_of_and_four_more(back: int, age) -> None:
    made = Place()
    for _ in range(8):
        made.show(wall())
    made.scene.show(HeatMap(NOBODY, made.stamp_ns - back * 10**7, 1.0))
    shown = made.view.heat
    assert (None if shown is None else shown.frames) == age


def test_where_the_place_went_since_it_was_learnt_is_told_in_the_order_of_the_frames() -> None:
    zoom, pan = np.diag([2.0, 2.0, 1.0]), np.eye(3)
    pan[0, 2] = 10
    place = WholeView(SOURCE, 1.0)
    for camera in zoom, pan:
        place.expected(WorldMotion(camera), Regions())
    assert place._since.carry(5, 5) == pytest.approx((20, 10))


def test_the_noise_is_measured_beside_where_people_of_a_late_mask_are_by_now(monkeypatch) -> None:
    made, wide, asked = Place(), np.concatenate([wall(), wall()], axis=1), []

    def measured(model: BackgroundModel, lab: np.ndarray, people: np.ndarray, windows) -> None:
        asked.append(people.copy())

    monkeypatch.setattr(BackgroundModel, 'measure_noise', measured)
    person = NOBODY.copy()
    person[50:130, 100:130] = 255
    for number in range(12):
        made.show(np.ascontiguousarray(wide[:, 2 * number :][:, : SOURCE[1]]))
        if number >= 3:
            made.learn(np.roll(person, -2 * (number - 3), 1), back=3)
    now = np.roll(person, -2 * 11, 1) > 0
    assert (asked[-1][now] > 0).mean() > 0.95
    assert not asked[-1][60:120, 112:140].any()
