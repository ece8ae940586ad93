# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.finding.scene import MotionScene, SceneFrame

SHAPE = (120, 160)
FIRST = 1.0
PERIOD = 0.04


def wall(width: int = 400) -> np.ndarray:
    """Return a wide textured wall, (140, width, 3) float32."""
    rng = np.random.default_rng(2)
    coarse = rng.uniform(70, 180, (35, width // 4, 3)).astype(np.float32)
    coarse[..., 1:] = 128
    return cv2.resize(coarse, (width, 140), interpolation=cv2.INTER_CUBIC)


def play(
    frames: int, speed: float = 2.0, pan: float = 0.0, gain: dict[int, float] | None = None
) -> list[SceneFrame]:
    """Show a bright upright block that walks before the wall from frame 0 on."""
    scene, place, shown = MotionScene(SHAPE), wall(), []
    rng = np.random.default_rng(3)
    for number in range(frames):
        matrix = np.array([[1.0, 0, -20 - pan * number], [0, 1.0, -5]])
        image = cv2.warpAffine(place, matrix, SHAPE[::-1], flags=cv2.INTER_CUBIC)
        left = round(20 + speed * number)
        image[30:90, left : left + 16] = (230, 90, 160)
        image[..., 0] *= (gain or {}).get(number, 1.0)
        image += rng.normal(0, 2, image.shape)
        shown.append(
            scene.update(np.clip(image, 0, 255).astype(np.uint8), FIRST + PERIOD * number)
        )
    return shown


def block(number: int, speed: float = 2.0) -> np.ndarray:
    out = np.zeros(SHAPE, np.bool_)
    left = round(20 + speed * number)
    out[30:90, left : left + 16] = True
    return out


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_a_walker_of_the_first_frame_soon_stands_out(pan: float) -> None:
    frame = play(16, pan=pan)[-1]
    found, true = frame.likelihood > 127, block(15)
    # Where he stood at first nothing is known yet.
    found[:, :38] = False
    assert (found & true).sum() / (found | true).sum() > 0.8


def test_the_canvas_follows_the_camera() -> None:
    frames = play(30, pan=1.3)
    moved = sum(frame.shift[0] for frame in frames) + frames[-1].to_image[0, 2]
    assert moved == pytest.approx(-1.3 * 29, abs=1.0)
    assert all(frame.shift[1] == 0 for frame in frames)


def test_what_stays_becomes_background() -> None:
    scene, place = MotionScene(SHAPE), wall()[5:125, 20:180]
    rng = np.random.default_rng(3)

    def show(number: int, image: np.ndarray) -> SceneFrame:
        noisy = np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        return scene.update(noisy, FIRST + PERIOD * number)

    for number in range(10):
        show(number, place)
    left = place.copy()
    left[40:80, 60:80] = (230, 90, 160)
    assert (show(10, left).likelihood[42:78, 62:78] > 127).all()
    for number in range(11, 45):
        frame = show(number, left)
    assert (frame.likelihood > 127).mean() < 0.01


def test_another_picture_begins_anew() -> None:
    scene, places = MotionScene(SHAPE), (wall()[5:125, 20:180], wall()[125:5:-1, 380:220:-1])
    rng = np.random.default_rng(3)
    fresh = []
    for number in range(24):
        image = places[number >= 12] + rng.normal(0, 2, (*SHAPE, 3))
        image = np.clip(image, 0, 255).astype(np.uint8)
        frame = scene.update(image, FIRST + PERIOD * number)
        fresh.append(frame.fresh)
    assert fresh.index(True) == 12
    assert frame.blobs == []


def test_a_still_scene_has_no_blobs() -> None:
    frames = play(12, speed=0.0)
    assert all(frame.blobs == [] and frame.shift == (0, 0) for frame in frames[2:])
    assert (frames[-1].likelihood > 127).mean() < 0.005


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_who_is_known_is_no_blob_and_is_not_learnt(pan: float) -> None:
    scene, place = MotionScene(SHAPE), wall()
    rng = np.random.default_rng(3)
    for number in range(20):
        matrix = np.array([[1.0, 0, -20 - pan * number], [0, 1.0, -5]])
        image = cv2.warpAffine(place, matrix, SHAPE[::-1], flags=cv2.INTER_CUBIC)
        known, other = Box(20 + number, 30, 16, 60), Box(60 + 2 * number, 40, 24, 50)
        for box in (known, other):
            image[box.slices(SHAPE[1], SHAPE[0])] = (230, 90, 160)
        noisy = np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        frame = scene.update(noisy, FIRST + PERIOD * number, [known])
    boxes = [blob.box.shifted(frame.to_image[0, 2], 0) for blob in frame.blobs]
    assert max(box.iou(other) for box in boxes) > 0.5
    assert max(box.iou(known) for box in boxes) < 0.1
    # Once it is not known any more it stands out at once.
    frame = scene.update(noisy, FIRST + PERIOD * 20)
    boxes = [blob.box.shifted(frame.to_image[0, 2], 0) for blob in frame.blobs]
    assert max(box.iou(known) for box in boxes) > 0.5


@pytest.mark.parametrize('pan', [0.0, 1.3])
def test_blobs_are_shown_where_they_are_in_the_image(pan: float) -> None:
    frame = play(16, pan=pan)[-1]
    largest = frame.blobs[0].number
    assert not frame.of([]).any()
    assert ((frame.of([largest]) > 0) == (frame.owners == largest)).all()
    found = frame.in_image(frame.of([largest])) > 127
    assert found[block(15)].mean() > 0.9
    assert found[:, 70:].mean() < 0.02


def test_a_box_of_the_canvas_moves_with_it() -> None:
    frame = play(16, pan=1.3)[-1]
    box = frame.box_in_image(Box(20, 30, 10, 40))
    assert (box.width, box.height) == (10, 40)
    assert box.x - 20 == pytest.approx(frame.to_image[0, 2], abs=0.5)
