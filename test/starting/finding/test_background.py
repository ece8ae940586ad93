# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.finding.background import MotionBackground

SHAPE = (40, 60)
NOWHERE = np.zeros(SHAPE, np.uint8)


def place() -> np.ndarray:
    rng = np.random.default_rng(4)
    return rng.uniform(90, 160, (*SHAPE, 3)).astype(np.uint8)


def learnt(frames: int = 8, keep: np.ndarray = NOWHERE) -> MotionBackground:
    background = MotionBackground(SHAPE)
    for _ in range(frames):
        background.learn(place(), NOWHERE, keep, 0.04)
    return background


def test_what_differs_stands_out_and_a_shadow_less_so() -> None:
    background = learnt()
    image = place()
    image[10:20, 10:20, 0] //= 3
    image[10:20, 30:40, 0] = np.rint(0.85 * image[10:20, 30:40, 0])
    likelihood = background.compare(image, NOWHERE)
    assert (likelihood[10:20, 10:20] == 255).all()
    assert likelihood[10:20, 30:40].max() < 128
    assert not likelihood[25:].any()


def test_where_nothing_is_known_only_motion_counts() -> None:
    keep = NOWHERE.copy()
    keep[:, :30] = 255
    background = learnt(keep=keep)
    moving = NOWHERE.copy()
    moving[5:10] = 255
    likelihood = background.compare(place(), moving)
    assert (likelihood[5:10, :30] > 127).all()
    assert not likelihood[:, 30:].any()


@pytest.mark.parametrize(('known', 'patience'), [(60, 15), (12, 8)])
def test_what_is_new_must_stay_longer_than_where_little_is_known(
    known: int, patience: int
) -> None:
    background, image = learnt(known), place()
    image[5:15, 5:15] = 250
    for _ in range(patience - 1):
        background.learn(image, NOWHERE, NOWHERE, 0.04)
    assert (background.compare(image, NOWHERE)[5:15, 5:15] == 255).all()
    for _ in range(3):
        background.learn(image, NOWHERE, NOWHERE, 0.04)
    assert not background.compare(image, NOWHERE).any()


def test_patience_is_a_time() -> None:
    background, image = learnt(60), place()
    image[5:15, 5:15] = 250
    for _ in range(9):
        background.learn(image, NOWHERE, NOWHERE, 0.08)
    assert not background.compare(image, NOWHERE).any()


def test_it_moves_with_the_canvas() -> None:
    background = learnt()
    background.shift(3, -2)
    shifted = np.roll(place(), (-2, 3), axis=(0, 1))
    assert not background.compare(shifted, NOWHERE)[:-2, 3:].any()
    background.warp(np.array([[1.0, 0, -3], [0, 1.0, 2]]))
    assert not background.compare(place(), NOWHERE)[4:-4, 4:-4].any()


def test_the_level_follows_the_noise() -> None:
    background, rng = learnt(), np.random.default_rng(5)
    quiet = learnt(30).level
    for _ in range(30):
        noisy = place() + rng.normal(0, 6, (*SHAPE, 3))
        background.learn(noisy.astype(np.uint8), NOWHERE, NOWHERE, 0.04)
    assert background.level > 1.5 * quiet


def test_a_shift_is_told() -> None:
    smooth = np.tile(np.linspace(60, 180, SHAPE[1]), (SHAPE[0], 1))
    colours = np.repeat(smooth[..., None], 3, axis=2).astype(np.uint8)
    background = MotionBackground(SHAPE)
    for _ in range(5):
        background.learn(colours, NOWHERE, NOWHERE, 0.04)
    still = np.array([[1.0, 0, 0], [0, 1.0, 0]])
    error, count, xx, _, _, x, _ = background.mismatch(colours[..., 0], NOWHERE, still)
    assert (error, count) == (0, pytest.approx(SHAPE[0] * SHAPE[1] / 9, rel=0.25))
    later = np.clip(smooth + 2, 0, 255).astype(np.uint8)
    error, _, xx, _, _, x, _ = background.mismatch(later, NOWHERE, still)
    assert error == pytest.approx(2, abs=0.5)
    # Brighter by one step of the ramp is the ramp one pixel on.
    assert x / xx == pytest.approx(-2 / (120 / 59), abs=0.4)
