# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from functools import cache

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.place import PlaceMemory, moving_bodies
from gait_segmentation.scene.scene import Scene

SHAPE = (120, 160)
RED = (40, 30, 220)


@cache
def wall() -> np.ndarray:
    """Return a wide textured wall, (140, 400, 3) float32."""
    coarse = np.random.default_rng(2).uniform(70, 180, (35, 100, 1)).astype(np.float32)
    fine = cv2.resize(coarse, (400, 140), interpolation=cv2.INTER_CUBIC)
    return np.repeat(fine[..., None], 3, axis=2)


def seen(number: int, pan: float = 0.0) -> np.ndarray:
    """Return what a camera that turns sees of the wall in a frame, (120, 160, 3) float32."""
    matrix = np.array([[1.0, 0, -20 - pan * number], [0, 1.0, -5]])
    return np.asarray(cv2.warpAffine(wall(), matrix, SHAPE[::-1], flags=cv2.INTER_CUBIC))


class Watch:
    """A scene, and what moves in it."""

    def __init__(self) -> None:
        self.scene = Scene(SHAPE)
        self.place: PlaceMemory | None = None

    def show(self, number: int, image: np.ndarray, *known: Box) -> np.ndarray:
        """Show a frame, with noise; return what moves in it beside who is known."""
        noisy = image + np.random.default_rng(number).normal(0, 2, image.shape)
        stamp_ns = 10**9 + 100_000_000 * number
        self.scene.advance(np.clip(noisy, 0, 255).astype(np.uint8), stamp_ns)
        self.place = self.place or PlaceMemory(self.scene)
        self.place.update(known)
        return self.scene.moving > 0

    def background(self) -> BackgroundModel:
        return self.place.known.known(SHAPE)


def block(number: int) -> Box:
    return Box(20 + 2 * number, 30, 16, 60)


def inside(box: Box) -> np.ndarray:
    out = np.zeros(SHAPE, np.bool_)
    out[box.slices(SHAPE[1], SHAPE[0])] = True
    return out


def lab_of(image: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(np.clip(image, 0, 255).astype(np.uint8), cv2.COLOR_BGR2Lab)


def test_what_comes_to_stay_becomes_background_the_sooner_the_less_was_known() -> None:
    times, part = [], (slice(42, 78), slice(62, 78))
    for known in (10, 60):
        scene = Watch()
        for number in range(known):
            scene.show(number, seen(0))
        image = seen(0)
        image[40:80, 60:80] = RED
        for number in range(known, known + 60):
            scene.show(number, image)
            place = scene.background()
            off = np.abs(place.mean[part] - lab_of(image)[part].astype(float))
            if place.count[part].min() >= 2 and off.max() < 12:
                break
        times.append(number - known)
    assert 2 < times[0] < times[1] < 40


def test_another_picture_begins_anew() -> None:
    scene, other = Watch(), seen(0)[::-1, ::-1]
    for number in range(18):
        moving = scene.show(number, seen(0) if number < 12 else other)
        # Nothing of it is taken for somebody.
        assert not moving.any() or number < 12
    known = scene.background()
    assert np.abs(known.mean - lab_of(other))[known.count >= 2].max() < 12


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_who_is_known_is_no_blob_and_is_not_learnt(pan: float) -> None:
    scene = Watch()
    for number in range(24):
        image = seen(number, pan)
        known, other = Box(20 + number, 30, 16, 60), Box(60 + 2 * number, 40, 24, 50)
        for box in (known, other):
            image[inside(box)] = RED
        moving = scene.show(number, image, known.padded(3, 3))
    assert Box.around(moving[:, 85:]).shifted(85, 0).iou(other) > 0.5
    # What is taken for known is not looked at.
    assert moving[inside(known)].all()
    place, path = scene.background(), np.zeros(SHAPE, np.bool_)
    path[32:88, 22:42] = True
    off = np.abs(place.mean - lab_of(seen(23, pan)))[path & (place.count >= 2)]
    assert np.percentile(off, 95) < 12


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_a_walker_of_the_first_frame_and_the_place_behind_are_soon_known(pan: float) -> None:
    scene, shown = Watch(), []
    for number in range(30):
        image = seen(number, pan)
        image[inside(block(number))] = RED
        shown.append(scene.show(number, image))
    assert shown[15][inside(block(15))].mean() > 0.8
    assert shown[15][:, 74:].mean() < 0.02
    found, truth = scene.background(), seen(29, pan)
    known = found.count >= 2
    # Also where the walker was at first.
    assert known[30:90, 5:60].mean() > 0.9
    # What has just come into view at the right is not.
    known[:, 140:] = False
    assert np.percentile(np.abs(found.mean - lab_of(truth))[known], 95) < 12
    person = seen(29, pan)
    person[true := inside(block(29))] = RED
    evidence = found.evidence(lab_of(person), 0.5)
    assert np.median(evidence[true & known]) > 1
    assert np.median(evidence[~true & known]) < -1


def test_what_always_moves_is_never_learnt_and_what_has_left_is_not_mixed_in() -> None:
    scene = Watch()
    for number in range(50):
        image = seen(0)
        image[30:90, 60:80] = (20, 20, 200) if number // 2 % 2 else (200, 20, 20)
        if number < 15:
            image[60:100, 110:150] = (40, 200, 40)
        scene.show(number, image)
        if number == 24:
            count = scene.background().count
            assert not count[34:86, 64:76].any()
            assert count[:, :50].min() > 5
    known, part = scene.background(), (slice(62, 98), slice(112, 148))
    assert (known.count[part] >= 2).all()
    assert np.abs(known.mean[part] - lab_of(seen(0))[part].astype(float)).max() < 12
    # Nobody looks at what moves from now on.
    scene.place.close()
    assert scene.scene.moving is None
    assert scene.scene.views == []


def image(*boxes: tuple[int, int, int, int]) -> np.ndarray:
    """Return (120, 160) uint8, 255 in the boxes (x, y, width, height)."""
    out = np.zeros(SHAPE, np.uint8)
    for box in boxes:
        out[inside(Box(*box))] = 255
    return out


def test_all_that_moves_is_marked_and_nothing_between_those_beside_each_other() -> None:
    body = image((40, 20, 20, 40), (42, 66, 8, 30))
    assert np.array_equal(moving_bodies(body, body), body)
    apart = image((40, 20, 20, 40), (80, 66, 8, 30))
    moves = image((40, 20, 2, 40), (58, 20, 2, 40), (80, 66, 8, 30))
    assert np.array_equal(moving_bodies(apart, moves), apart)
    # One beside a leg and above the foot of the other.
    within = image((40, 20, 6, 60), (40, 76, 40, 4), (66, 20, 10, 30))
    assert np.array_equal(moving_bodies(within, within), within)


def test_only_what_moves_now_is_marked() -> None:
    # A walker beside the place that was uncovered when he left, still joined to it.
    now = image((60, 20, 20, 60))
    assert np.array_equal(moving_bodies(image((20, 20, 60, 60)), now), now)


def test_rows_are_filled_between_what_moves() -> None:
    # Of a plain coat only the edges are seen to move.
    edges = image((40, 20, 3, 60), (57, 20, 3, 60))
    coat = image((40, 20, 20, 60))
    assert np.array_equal(moving_bodies(coat, edges), coat)


def test_specks_and_what_does_not_move_are_no_bodies() -> None:
    assert not moving_bodies(image((10, 10, 2, 2)), image((10, 10, 2, 2))).any()
    assert not moving_bodies(image((10, 10, 20, 40)), image()).any()
    assert not moving_bodies(image(), image()).any()


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_a_box_shows_who_moves_unless_they_are_known(pan: float) -> None:
    scene, found = Watch(), []
    for number in range(20):
        image, known = seen(number, pan), block(number).shifted(70, 0)
        image[inside(block(number)) | inside(known)] = RED
        scene.show(number, image, known.padded(3, 3))
        rests = block(number).shifted(35, 0)
        found.append([scene.place.moves(box) for box in (block(number), rests, known)])
    assert found[10:] == [[True, False, False]] * 10
