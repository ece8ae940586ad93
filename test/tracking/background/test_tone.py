# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np

from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.background.tone import tone_curve

SHAPE = (90, 120)
ALL = [(slice(0, 90), slice(0, 120))]
NOBODY = np.zeros(SHAPE, np.uint8)
DEEPER = np.interp(np.arange(256), [0, 60, 200, 255], [0, 45, 198, 255]).astype(np.uint8)
"""A tone curve that deepens the shadows and leaves the lights alone."""


def scene(seed: int = 0) -> np.ndarray:
    """Return a grey picture of all levels with some noise, (h, w, 3) uint8 BGR."""
    rng = np.random.default_rng(seed)
    levels = np.linspace(30, 220, SHAPE[1])[None, :] + rng.normal(0, 1.5, SHAPE)
    return np.repeat(np.clip(levels, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def lab_of(bgr: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2Lab))


def remembered() -> np.ndarray:
    model = BackgroundModel(SHAPE)
    for seed in range(4):
        model.learn(lab_of(scene(seed)), NOBODY)
    return model.sums


def test_a_bent_tone_curve_is_bent_back() -> None:
    bgr = cv2.LUT(scene(9), DEEPER)
    curve = tone_curve(remembered(), lab_of(bgr), NOBODY, ALL)
    assert curve is not None
    off = cv2.LUT(bgr, curve).astype(float) - scene(9)
    before = bgr.astype(float) - scene(9)
    assert np.abs(off).mean() < 0.25 * np.abs(before).mean()


def test_a_frame_of_the_same_tone_is_left_alone() -> None:
    assert tone_curve(remembered(), lab_of(scene(9)), NOBODY, ALL) is None


def test_edges_out_of_place_are_no_change_of_tone() -> None:
    rng = np.random.default_rng(1)
    plate = cv2.GaussianBlur(rng.integers(0, 255, (*SHAPE, 3)).astype(np.uint8), (0, 0), 2)
    lab = lab_of(cv2.normalize(plate, None, 20, 230, cv2.NORM_MINMAX))
    model = BackgroundModel(SHAPE)
    for _ in range(3):
        model.learn(lab, NOBODY)
    assert tone_curve(model.sums, np.roll(lab, 2, axis=1), NOBODY, ALL) is None


def test_what_only_part_of_the_picture_shows_is_no_change_of_tone() -> None:
    bgr = scene(9)
    bgr[:40] = np.clip(bgr[:40].astype(int) + 35, 0, 255).astype(np.uint8)
    assert tone_curve(remembered(), lab_of(bgr), NOBODY, ALL) is None


def test_people_are_not_looked_at() -> None:
    bgr = scene(9)
    bgr[:, 10:110] = 20
    people = np.zeros(SHAPE, np.uint8)
    people[:, 10:110] = 1
    assert tone_curve(remembered(), lab_of(bgr), people, ALL) is None


def test_without_a_memory_nothing_is_undone() -> None:
    empty = np.zeros((*SHAPE, 4), np.float32)
    assert tone_curve(empty, lab_of(scene()), NOBODY, ALL) is None
