# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.background.registration import remaining_shift

SHAPE = (80, 100)
ALL = [(slice(0, 80), slice(0, 100))]
NOBODY = np.zeros(SHAPE, np.uint8)


def plate() -> np.ndarray:
    rng = np.random.default_rng(3)
    wide = cv2.GaussianBlur(rng.uniform(0, 255, (120, 140, 3)).astype(np.float32), (0, 0), 3)
    return np.asarray(cv2.normalize(wide, None, 0, 255, cv2.NORM_MINMAX))


def view(dx: float, dy: float, picture: np.ndarray | None = None) -> np.ndarray:
    """Return the plate moved by some pixels, (h, w, 3) uint8."""
    matrix = np.array([[1.0, 0, dx - 20], [0, 1.0, dy - 20]])
    wide = plate() if picture is None else picture
    moved = cv2.warpAffine(wide, matrix, SHAPE[::-1], flags=cv2.INTER_CUBIC)
    return np.clip(np.rint(moved), 0, 255).astype(np.uint8)


def remembered(lab: np.ndarray) -> np.ndarray:
    model = BackgroundModel(SHAPE)
    for _ in range(3):
        model.learn(lab, NOBODY)
    return model.sums


# In steps of 1 / 32 pixel, which is all that warpAffine of OpenCV 4 knows.
@pytest.mark.parametrize('shift', [(10 / 32, 0.0), (-6 / 32, 8 / 32), (3 / 32, -13 / 32)])
def test_a_part_of_a_pixel_is_seen(shift: tuple[float, float]) -> None:
    found = remaining_shift(remembered(view(0, 0)), view(*shift), NOBODY, ALL)
    assert found == pytest.approx(shift, abs=0.06)


def test_what_fits_is_left_alone() -> None:
    assert remaining_shift(remembered(view(0, 0)), view(0, 0), NOBODY, ALL) is None


def test_along_stripes_nothing_moves() -> None:
    rows = 127 + 60 * np.sin(np.arange(120) / 2)
    stripes = np.repeat(np.repeat(rows[:, None, None], 140, axis=1), 3, axis=2)
    stripes = stripes.astype(np.float32)
    moved = view(10 / 32, 10 / 32, stripes)
    found = remaining_shift(remembered(view(0, 0, stripes)), moved, NOBODY, ALL)
    assert found == pytest.approx((0.0, 10 / 32), abs=0.06)


def test_people_are_not_looked_at() -> None:
    lab = view(0, 0)
    lab[:, 20:80] = view(0.5, 0)[:, 20:80]
    people = np.zeros(SHAPE, np.uint8)
    people[:, 19:81] = 1
    assert remaining_shift(remembered(view(0, 0)), lab, people, ALL) is None


def test_a_flat_or_unknown_picture_says_nothing() -> None:
    flat = np.full((*SHAPE, 3), 120, np.uint8)
    assert remaining_shift(remembered(flat), flat, NOBODY, ALL) is None
    assert remaining_shift(np.zeros((*SHAPE, 4), np.float32), view(0, 0), NOBODY, ALL) is None
