# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.finding.difference import RecentFrames

SHAPE = (40, 60)


def frame(left: int) -> np.ndarray:
    image = np.full(SHAPE, 100, np.uint8)
    image[10:30, left : left + 8] = 200
    return image


def test_what_moved_in_the_last_moments_is_shown() -> None:
    recent = RecentFrames()
    for number in range(8):
        moving = recent.update(frame(10 + 2 * number), 1 + 0.04 * number, 8.0)
    assert recent.period == pytest.approx(0.04)
    columns = np.flatnonzero(moving[20])
    # Compared with four frames before: eight pixels went by.
    assert (columns.min(), columns.max()) == (16, 31)
    assert not moving[:9].any()


def test_nothing_moves_with_the_canvas() -> None:
    recent = RecentFrames()
    recent.update(frame(10), 1.0, 8.0)
    recent.shift(5, 0)
    assert not recent.update(frame(15), 1.2, 8.0).any()
    recent.warp(np.array([[1.0, 0, 3], [0, 1.0, 0]]))
    assert not recent.update(frame(18), 1.4, 8.0).any()
    assert recent.update(frame(24), 1.6, 8.0).any()


def test_the_rim_of_a_shifted_frame_is_not_compared() -> None:
    recent = RecentFrames()
    recent.update(np.zeros(SHAPE, np.uint8), 1.0, 8.0)
    recent.shift(-6, 4)
    moving = recent.update(np.full(SHAPE, 200, np.uint8), 1.2, 8.0)
    assert not moving[:6].any()
    assert not moving[:, -8:].any()
    assert moving[8:38, 2:50].all()
