# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.finding.exposure import Exposure

SHAPE = (96, 128)
NOTHING = np.zeros(SHAPE, np.uint8)
KNOWN = np.ones(SHAPE, np.uint8)


def scene(gain: float = 1.0, seed: int = 1) -> np.ndarray:
    """Return a place, (96, 128, 3) uint8: lightness 60 to 160 and some chroma."""
    values = np.random.default_rng(seed).uniform(60, 160, (*SHAPE, 3))
    values[:, :, 1:] = 128 + 0.2 * (values[:, :, 1:] - 110)
    values[:, :, 0] *= gain
    values[:, :, 1:] = 128 + gain * (values[:, :, 1:] - 128)
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def off(image: np.ndarray) -> float:
    return float(np.abs(image.astype(int) - scene()).mean())


def test_an_even_exposure_changes_nothing() -> None:
    exposure = Exposure()
    for _ in range(3):
        image = scene()
        assert exposure.undo(image) is image
        assert exposure.settle(image, scene(), KNOWN, NOTHING) is image


@pytest.mark.parametrize('gain', [0.6, 1.4])
def test_a_jump_is_undone_at_once(gain: float) -> None:
    exposure = Exposure()
    exposure.undo(scene())
    assert off(scene(gain)) > 10
    assert off(exposure.undo(scene(gain))) < 2
    assert off(exposure.undo(scene(gain))) < 2
    assert off(exposure.undo(scene())) < 2


def test_a_drift_is_measured_by_the_background() -> None:
    exposure = Exposure()
    for number in range(12):
        image = exposure.undo(scene(1.03**number))
        assert off(exposure.settle(image, scene(), KNOWN, NOTHING)) < 2.5
    assert off(exposure.undo(scene(1.03**11))) < 2.5


def test_what_moves_says_nothing() -> None:
    exposure = Exposure()
    hidden = NOTHING.copy()
    hidden[:, 50:] = 255
    image = scene()
    image[:, 50:] = image[:, 50:] // 2
    exposure.undo(scene())
    assert exposure.settle(image, scene(), KNOWN, hidden) is image


def test_another_picture_is_no_other_exposure() -> None:
    exposure = Exposure()
    exposure.undo(scene())
    other = np.roll(scene(), 9, axis=1)
    assert exposure.undo(other) is other


def test_what_is_as_bright_as_can_be_may_be_the_background() -> None:
    exposure = Exposure()
    before = scene()
    before[:20, :, 0] = 240
    bright = scene(1.5)
    bright[:20, :, 0] = 255
    exposure.undo(before)
    settled = exposure.settle(exposure.undo(bright), before, KNOWN, NOTHING)
    np.testing.assert_array_equal(settled[:20, :, 0], before[:20, :, 0])


def test_another_and_darker_picture_is_no_other_exposure() -> None:
    exposure = Exposure()
    exposure.undo(scene())
    darker = np.roll(scene(0.8), 9, axis=1)
    assert exposure.undo(darker) is darker


def test_what_undoing_would_not_mend_is_no_drift() -> None:
    exposure = Exposure()
    other = np.roll(scene(1.05), 9, axis=1)
    exposure.undo(other)
    assert exposure.settle(other, scene(), KNOWN, NOTHING) is other
