# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.images import Window
from gait_segmentation.starting.finding.overlay import exposed_alike, laid, misplaced, warped

EVERY: Window = (slice(0, 60), slice(0, 80))
NOBODY = np.zeros((60, 80), np.uint8)


def place() -> np.ndarray:
    rng = np.random.default_rng(6)
    coarse = rng.uniform(60, 180, (15, 20, 3)).astype(np.uint8)
    return cv2.resize(coarse, (80, 60), interpolation=cv2.INTER_CUBIC)


def test_a_mask_is_laid_into_a_window() -> None:
    mask = np.zeros((30, 40), np.uint8)
    mask[10:20, 5:10] = 255
    out = laid(mask, np.array([[2.0, 0, 4], [0, 2.0, 0]]), (slice(10, 50), slice(10, 40)))
    assert out.shape == (40, 30)
    rows, columns = np.nonzero(out)
    assert (rows.min(), rows.max()) == pytest.approx((10, 29), abs=1)
    assert (columns.min(), columns.max()) == pytest.approx((4, 13), abs=1)


def test_a_frame_shows_nothing_outside() -> None:
    part, outside = warped(place(), np.array([[1.0, 0, 10], [0, 1.0, 0]]), EVERY)
    np.testing.assert_array_equal(part[:, 10:], place()[:, :-10])
    assert (outside[:, :10] == 255).all()
    assert not outside[:, 10:].any()


@pytest.mark.parametrize('size', [(1, 1), (1, 4), (4, 1)])
def test_windows_of_a_pixel_or_a_line_are_laid(size: tuple[int, int]) -> None:
    """OpenCV takes some of them for a number beside the image."""
    window, still = (slice(3, 3 + size[0]), slice(5, 5 + size[1])), np.eye(2, 3)
    np.testing.assert_array_equal(laid(NOBODY | 9, still, window), np.full(size, 255))
    part, outside = warped(place(), still, window)
    np.testing.assert_array_equal(part, place()[window])
    np.testing.assert_array_equal(outside, np.zeros(size))


@pytest.mark.parametrize('gain', [0.8, 1.25])
def test_the_exposure_is_undone_off_people(gain: float) -> None:
    now, then = place(), cv2.convertScaleAbs(place(), alpha=gain)
    then[:, :20] = 255
    hidden = NOBODY.copy()
    hidden[:, :20] = 255
    off = np.abs(exposed_alike(then, now, hidden).astype(int) - now)[:, 20:]
    assert off.mean() < 1
    np.testing.assert_array_equal(exposed_alike(then, now, hidden | 255), then)


def test_a_small_shift_is_found_and_a_large_one_is_not_believed() -> None:
    moved = cv2.warpAffine(
        place(),
        np.array([[1.0, 0, 0.8], [0, 1.0, -0.6]]),
        (80, 60),
        borderMode=cv2.BORDER_REPLICATE,
    )
    assert misplaced(moved, place(), NOBODY) == pytest.approx((0.8, -0.6), abs=0.15)
    assert misplaced(moved, place(), NOBODY | 255) == (0, 0)
    assert max(map(abs, misplaced(np.roll(place(), 9, axis=1), place(), NOBODY))) <= 2.5


@pytest.mark.parametrize('level', [0, 128, 255])
def test_a_flat_frame_tells_no_shift(level: int) -> None:
    flat = np.full((60, 80, 3), level, np.uint8)
    assert misplaced(flat, flat, NOBODY) == (0, 0)
    assert misplaced(flat, np.full_like(flat, 120), NOBODY) == (0, 0)


def test_an_edge_tells_no_shift_along_it() -> None:
    edge = np.zeros((60, 80, 3), np.uint8)
    edge[:, 40:] = 12
    assert misplaced(np.roll(edge, 1, axis=1), edge, NOBODY) == (0, 0)
