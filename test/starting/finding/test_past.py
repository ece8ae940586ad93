# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import scaling
from gait_segmentation.lab import gray_lab
from gait_segmentation.starting.finding.past import Past
from gait_segmentation.starting.finding.scene import SceneFrame
from gait_segmentation.tracking.background.model import BackgroundModel

SHAPE, SMALL = (120, 160), (60, 80)
EVERY = (slice(0, 120), slice(0, 160))


def place() -> np.ndarray:
    rng = np.random.default_rng(1)
    coarse = rng.uniform(60, 180, (30, 40, 3)).astype(np.uint8)
    return cv2.resize(coarse, (240, 180), interpolation=cv2.INTER_CUBIC)


def walking(number: int, pan: int = 0) -> tuple[np.ndarray, SceneFrame]:
    """Return a frame in which a red bar moves to the right, and where it hides the place."""
    image = place()[:120, pan * number : pan * number + 160].copy()
    hidden = np.zeros(SMALL, np.uint8)
    left = 20 + 8 * number
    image[30:100, left : left + 20] = (20, 20, 200)
    hidden[15:50, left // 2 : left // 2 + 10] = 255
    step = None if pan == 0 else np.array([[1.0, 0, -pan / 2], [0, 1.0, 0]])
    return image, SceneFrame(hidden, [], hidden, (0, 0), scaling(1.0), step, hidden, False)


def learnt(
    pan: int = 0, frames: int = 12, gain: float = 1.0, *, grey: bool = False
) -> BackgroundModel:
    """Return what is known in the last frame, before which the camera was darker."""
    past = Past(SHAPE)
    for number in range(frames):
        image, frame = walking(number, pan)
        if grey:
            image = cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
        if number < frames - 1:
            image = cv2.convertScaleAbs(image, alpha=gain)
        past.update(image, frame, 1 + 0.13 * number)
    return past.background(SHAPE)


@pytest.mark.parametrize('pan', [0, 2])
def test_the_place_behind_somebody_is_known(pan: int) -> None:
    found = learnt(pan)
    gone = 11 * pan
    truth = cv2.cvtColor(place()[:120, gone : gone + 160], cv2.COLOR_BGR2Lab)
    known = found.count >= 2
    known[:, 140:] = False
    assert known[:, :130].mean() > 0.9
    assert np.percentile(np.abs(found.mean - truth)[known], 95) < 8


def test_a_grey_place_is_known_with_its_texture() -> None:
    found = learnt(grey=True)
    truth = gray_lab(cv2.cvtColor(place()[:120, :160], cv2.COLOR_BGR2GRAY))
    known = found.count >= 2
    known[:, 140:] = False
    # The bar's edges change the texture beside it.
    assert np.median(np.abs(found.mean - truth)[known]) < 4
    assert np.ptp(truth[..., 1]) > 8


def test_a_jump_of_the_exposure_is_undone_for_who_looks_on() -> None:
    past = Past(SHAPE)
    for number in range(8):
        image, frame = walking(number)
        past.update(
            image if number < 7 else cv2.convertScaleAbs(image, alpha=0.7), frame, 1 + number
        )
    exposure, _ = past.levels()
    assert exposure.gain == pytest.approx(1 / 0.7, abs=0.05)


def test_somebody_stands_out_and_the_place_does_not() -> None:
    image, frame = walking(11)
    evidence = learnt().evidence(cv2.cvtColor(image, cv2.COLOR_BGR2Lab), EVERY, 0.5)
    person = cv2.resize(frame.hidden, SHAPE[::-1], interpolation=cv2.INTER_NEAREST) > 0
    assert np.median(evidence[person]) > 1
    assert np.median(evidence[~person]) < -1


def test_where_somebody_always_was_nothing_is_known() -> None:
    past = Past(SHAPE)
    image, frame = walking(0)
    for number in range(8):
        past.update(image, frame, 1 + 0.13 * number)
    assert not past.background(SHAPE).count[30:100, 20:40].any()


def test_few_frames_are_learnt_and_the_newest_is_only_looked_at() -> None:
    past = Past(SHAPE)
    image, frame = walking(0)
    for seconds in (1.0, 1.01, 1.1):
        past.update(image, frame, seconds)
    assert past.background(SHAPE).count.max() == 1
    past.update(image, frame, 1.2)
    assert past.background(SHAPE).count.max() == 2


def test_a_place_known_for_long_is_learnt_less_often() -> None:
    past = Past(SHAPE)
    image, frame = walking(0)
    times = []
    for number in range(300):
        seconds = 1 + 0.04 * number
        past.update(image, frame, seconds)
        if past.learnt == seconds:
            times.append(seconds)
    gaps = np.diff(times)
    # To the next frame.
    assert gaps[:8].max() < 0.17
    assert 0.35 < gaps[-8:].min() <= gaps[-8:].max() < 0.41


def test_it_is_known_at_the_size_of_who_asks() -> None:
    past = Past((480, 640))
    _, frame = walking(0)
    past.update(np.full((480, 640, 3), 90, np.uint8), frame, 1.0)
    assert past.background((240, 320)).count.shape == (240, 320)


def test_what_has_left_is_not_mixed_with_what_was_behind_it() -> None:
    past = Past(SHAPE)
    for number in range(9):
        image, frame = walking(number)
        if number < 5:
            image[60:100, 120:150] = (40, 200, 40)
        past.update(image, frame, 1 + 0.13 * number)
    known = past.background(SHAPE)
    truth = cv2.cvtColor(place()[:120, :160], cv2.COLOR_BGR2Lab)
    part = slice(62, 98), slice(122, 148)
    assert (known.count[part] >= 2).all()
    assert np.abs(known.mean[part] - truth[part].astype(float)).max() < 8
