# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shifts by block matching."""

from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.tracking.outline import Outline
from gait_segmentation.tracking.strangers.block_matching import matched_shift


def frames(dx: int, dy: int) -> tuple[Pyramid, Pyramid, Outline]:
    """Return a textured block before a wall in two frames, and its outline in the first."""
    rng = np.random.default_rng(0)
    wall, block = (
        rng.integers(0, 255, shape).repeat(2, 0).repeat(2, 1).astype(np.uint8)
        for shape in ((60, 80), (15, 10))
    )
    last, now = wall.copy(), wall.copy()
    last[40:70, 60:80] = block
    now[40 + dy : 70 + dy, 60 + dx : 80 + dx] = block
    mask = np.zeros((60, 80), np.uint8)
    mask[20:35, 30:40] = 255
    return Pyramid(last), Pyramid(now), Outline.of(mask)


def test_a_block_is_followed_before_a_wall() -> None:
    last, now, outline = frames(6, -4)
    assert matched_shift(last, now, outline, (0.0, 0.0), 10) == (6, -4)


def test_the_shift_is_sought_about_the_guess() -> None:
    last, now, outline = frames(24, 2)
    assert matched_shift(last, now, outline, (20.0, 0.0), 8) == (24, 2)


@pytest.mark.parametrize(('dx', 'dy'), [(12, 0), (-12, 0), (0, 12), (0, -12)])
def test_the_shift_is_not_sought_beyond_the_reach(dx: int, dy: int) -> None:
    last, now, outline = frames(dx, dy)
    assert matched_shift(last, now, outline, (0.0, 0.0), 12) == (dx, dy)
    assert max(map(abs, matched_shift(last, now, outline, (0.0, 0.0), 8))) <= 8


def test_what_is_outside_goes_on_as_guessed() -> None:
    last, now, outline = frames(6, -4)
    assert matched_shift(last, now, outline.shifted(400, 0), (3.0, 1.0), 8) == (3.0, 1.0)
