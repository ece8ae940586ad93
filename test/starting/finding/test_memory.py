# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import scaling
from gait_segmentation.images import Window
from gait_segmentation.lab import gray_lab
from gait_segmentation.starting.finding.memory import Memory
from gait_segmentation.starting.finding.recollection import Recollection

SHAPE, SMALL = (120, 160), (60, 80)
EVERY: Window = (slice(0, 120), slice(0, 160))
NOBODY = np.zeros(SMALL, np.uint8)


def place(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(60, 180, (30, 40, 3)).astype(np.uint8)
    return cv2.resize(coarse, (240, 180), interpolation=cv2.INTER_CUBIC)


def walking(number: int, wide: np.ndarray, pan: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return a frame in which a red bar moves to the right, and where it hides the place."""
    image = wide[:120, pan * number : pan * number + 160].copy()
    hidden = NOBODY.copy()
    left = 20 + 8 * number
    image[30:100, left : left + 20] = (20, 20, 200)
    hidden[15:50, left // 2 : left // 2 + 10] = 255
    return image, hidden


def test_a_grey_place_is_remembered_with_its_texture() -> None:
    memory, wide = Memory(), place()
    for number in range(12):
        image, hidden = walking(number, wide, 0)
        image = cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
        memory.update(image, 1 + 0.13 * number, None, hidden, scaling(1.0))
    found = memory.recall(image, EVERY, hidden, textured=True)
    assert found is not None
    truth = gray_lab(cv2.cvtColor(wide[:120, :160], cv2.COLOR_BGR2GRAY))
    known = found.count >= 2
    known[:, 140:] = False
    off = np.abs(found.mean.astype(int) - truth)[known]
    assert np.percentile(off, 90) < 8
    assert np.ptp(truth[..., 1]) > 8


def remembered(pan: int = 0, frames: int = 12, gain: float = 1.0) -> tuple[Recollection, int]:
    """Return what is known in the last frame, and how far the camera went."""
    memory, wide = Memory(), place()
    step = None if pan == 0 else np.array([[1.0, 0, -pan / 2], [0, 1.0, 0]])
    for number in range(frames):
        image, hidden = walking(number, wide, pan)
        if number < frames - 1:
            image = cv2.convertScaleAbs(image, alpha=gain)
        memory.update(image, 1 + 0.13 * number, step, hidden, scaling(1.0))
    found = memory.recall(image, EVERY, hidden)
    assert found is not None
    return found, pan * (frames - 1)


@pytest.mark.parametrize('pan', [0, 2])
@pytest.mark.parametrize('gain', [1.0, 0.8])
def test_the_place_behind_somebody_is_remembered(pan: int, gain: float) -> None:
    found, gone = remembered(pan, gain=gain)
    truth = cv2.cvtColor(place()[:120, gone : gone + 160], cv2.COLOR_BGR2Lab)
    known = found.count >= 2
    known[:, 140:] = False
    off = np.abs(found.mean.astype(int) - truth)[known]
    assert known[:, :140].mean() > 0.9
    assert np.percentile(off, 95) < 8


def test_somebody_stands_out_and_the_place_does_not() -> None:
    found, _ = remembered()
    image, hidden = walking(11, place())
    lab = cv2.cvtColor(image, cv2.COLOR_BGR2Lab)
    evidence = found.evidence(lab, 0.5)
    person = cv2.resize(hidden, (160, 120), interpolation=cv2.INTER_NEAREST) > 0
    assert evidence.dtype == np.float32
    assert np.median(evidence[person]) > 1
    assert np.median(evidence[~person]) < -1
    assert np.abs(evidence).max() <= 3


def test_where_somebody_always_was_nothing_is_known() -> None:
    memory, wide = Memory(), place()
    for number in range(8):
        image, hidden = walking(0, wide)
        memory.update(image, 1 + 0.13 * number, None, hidden, scaling(1.0))
    found = memory.recall(image, EVERY, hidden)
    assert found is not None
    assert not found.count[30:100, 20:40].any()
    lab = cv2.cvtColor(image, cv2.COLOR_BGR2Lab)
    assert not found.evidence(lab, 0.5)[32:98, 22:38].any()


def test_few_frames_are_kept_and_their_buffers_may_be_filled_anew() -> None:
    memory, wide = Memory(), place()
    buffer, hidden = walking(0, wide)
    memory.update(buffer, 1.0, None, NOBODY, scaling(1.0))
    assert memory.recall(buffer, EVERY, hidden) is None
    memory.update(buffer, 1.01, None, NOBODY, scaling(1.0))
    assert memory.recall(buffer, EVERY, hidden) is None
    memory.update(buffer, 1.2, None, NOBODY, scaling(1.0))
    before = memory.recall(buffer.copy(), EVERY, hidden)
    now = buffer.copy()
    buffer[:] = 0
    after = memory.recall(now, EVERY, hidden)
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(after.mean, before.mean)


def test_it_forgets() -> None:
    memory, wide = Memory(), place()
    for number in range(4):
        image, hidden = walking(number, wide)
        memory.update(image, 1 + 0.13 * number, None, hidden, scaling(1.0))
    assert memory.recall(image, (slice(5, 5), slice(0, 9)), hidden) is None
    assert memory.recall(np.zeros((240, 320, 3), np.uint8), EVERY, hidden) is None
    memory.forget()
    assert memory.recall(image, EVERY, hidden) is None
