# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from functools import cache

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.scene import Scene
from gait_segmentation.starting.moving import MotionDetector, MovingRegions, find_blobs

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
        self.detector: MotionDetector | None = None

    def show(self, number: int, image: np.ndarray, *known: Box) -> MovingRegions:
        """Show a frame, with noise."""
        noisy = image + np.random.default_rng(number).normal(0, 2, image.shape)
        stamp_ns = 10**9 + 40_000_000 * number
        self.scene.advance(np.clip(noisy, 0, 255).astype(np.uint8), stamp_ns)
        self.detector = self.detector or MotionDetector(self.scene, 1.0)
        return self.detector.update(known)

    def background(self) -> BackgroundModel:
        return self.detector.known.known(SHAPE)


def block(number: int) -> Box:
    return Box(20 + 2 * number, 30, 16, 60)


def inside(box: Box) -> np.ndarray:
    out = np.zeros(SHAPE, np.bool_)
    out[box.slices(SHAPE[1], SHAPE[0])] = True
    return out


def lab_of(image: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(np.clip(image, 0, 255).astype(np.uint8), cv2.COLOR_BGR2Lab)


def test_what_comes_to_stay_becomes_background_the_sooner_the_less_was_known() -> None:
    times = []
    for known in (10, 60):
        scene = Watch()
        for number in range(known):
            scene.show(number, seen(0))
        image = seen(0)
        image[40:80, 60:80] = RED
        frame = scene.show(known, image)
        assert (frame.evidence[42:78, 62:78] > 127).all()
        for number in range(known + 1, known + 60):
            if not (scene.show(number, image).evidence[42:78, 62:78] > 127).any():
                break
        times.append(number - known)
    assert 5 < times[0] < times[1] < 40


def test_another_picture_begins_anew() -> None:
    scene, places = Watch(), (seen(0), seen(0)[::-1, ::-1])
    frames = [scene.show(number, places[number >= 12]) for number in range(24)]
    assert [number for number, frame in enumerate(frames) if frame.fresh][:1] == [12]
    assert frames[-1].blobs == []


def test_a_shadow_does_not_stand_out() -> None:
    scene = Watch()
    for number in range(12):
        scene.show(number, seen(0))
    image = seen(0)
    image[30:60, 30:60] *= 0.8
    image[30:60, 90:120] *= 0.3
    # Once it does not move any more.
    evidence = [scene.show(number, image).evidence for number in range(12, 18)][-1]
    assert (evidence[33:57, 33:57] > 127).mean() < 0.1
    assert (evidence[33:57, 93:117] > 127).mean() > 0.9


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_who_is_known_is_no_blob_and_is_not_learnt(pan: float) -> None:
    scene = Watch()
    for number in range(24):
        image = seen(number, pan)
        known, other = Box(20 + number, 30, 16, 60), Box(60 + 2 * number, 40, 24, 50)
        for box in (known, other):
            image[inside(box)] = RED
        frame = scene.show(number, image, known.padded(3, 3))
    assert max(blob.box.iou(other) for blob in frame.blobs) > 0.5
    assert max(blob.box.iou(known) for blob in frame.blobs) < 0.1
    # Once it is not known any more it stands out at once.
    frame = scene.show(24, image)
    assert max(blob.box.iou(known) for blob in frame.blobs) > 0.4


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_a_walker_of_the_first_frame_and_the_place_behind_are_soon_known(pan: float) -> None:
    scene, shown = Watch(), []
    for number in range(30):
        image = seen(number, pan)
        image[inside(block(number))] = RED
        shown.append(scene.show(number, image))
    [blob] = [each for each in shown[24].blobs if each.box.iou(block(24)) > 0]
    assert blob.box.iou(block(24)) > 0.5
    silhouettes = shown[15].silhouettes
    assert (silhouettes[inside(block(15))] > 0).mean() > 0.9
    assert (silhouettes[:, 74:] > 0).mean() < 0.02
    assert sum(frame.shift[0] for frame in shown) == pytest.approx(-pan * 29, abs=2.0)
    assert abs(sum(frame.shift[1] for frame in shown)) < 1
    found, truth = scene.background(), seen(29, pan)
    known = found.count >= 2
    # Also where the walker was at first.
    assert known[30:90, 5:70].mean() > 0.9
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
        image[30:90, 60:80] = (20, 20, 200) if number // 4 % 2 else (200, 20, 20)
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


def image(*boxes: tuple[int, int, int, int]) -> np.ndarray:
    """Return (120, 160) uint8, 255 in the boxes (x, y, width, height)."""
    out = np.zeros(SHAPE, np.uint8)
    for box in boxes:
        out[inside(Box(*box))] = 255
    return out


def test_parts_above_each_other_are_one_body() -> None:
    body = image((40, 20, 20, 40), (42, 66, 8, 30))
    blobs, _ = find_blobs(body, body)
    assert [blob.box for blob in blobs] == [Box(40, 20, 20, 76)]
    assert blobs[0].area == blobs[0].moving == 20 * 40 + 8 * 30


def test_the_box_is_about_what_moves_now() -> None:
    # A walker beside the place that was uncovered when he left, still joined to it.
    evidence = image((20, 20, 60, 60))
    blobs, _ = find_blobs(evidence, image((60, 20, 20, 60)))
    assert [blob.box for blob in blobs] == [Box(60, 20, 20, 60)]
    assert blobs[0].area == 3600
    assert blobs[0].moving == 1200


def test_rows_are_filled_between_what_moves() -> None:
    # Of a plain coat only the edges are seen to move.
    edges = image((40, 20, 3, 60), (57, 20, 3, 60))
    coat = image((40, 20, 20, 60))
    _, filled = find_blobs(coat, edges)
    assert np.array_equal(filled, coat)


def test_specks_and_what_does_not_move_are_no_blobs() -> None:
    assert find_blobs(image((10, 10, 2, 2)), image((10, 10, 2, 2)))[0] == []
    assert find_blobs(image((10, 10, 20, 40)), image())[0] == []
    blobs, filled = find_blobs(image(), image())
    assert blobs == []
    assert not filled.any()
