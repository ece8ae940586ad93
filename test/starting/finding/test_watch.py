# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody watched must show to be taken for a walker."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from gait_segmentation.gait_model import render_silhouette
from gait_segmentation.geometry import Box
from gait_segmentation.starting import StartingConfig
from gait_segmentation.starting.finding import watch as watching
from gait_segmentation.starting.finding.candidates import Candidate
from gait_segmentation.starting.finding.watch import Watch, light_bank
from test.walkers import small_bank

PERIOD = 0.04
HEIGHT = 80.0
TALL = 90


def watched(
    *,
    speed: float = 3.0,
    top: int = 20,
    left: int = 20,
    wider: float = 1.0,
    frames: int = 30,
    **changes: float,
) -> list[Box]:
    """Return where a silhouette that walks to the right is found, in which row it may begin."""
    watch, found = None, []
    config = StartingConfig(**changes)
    for number in range(frames):
        drawn = render_silhouette(0.95 * PERIOD * number, 0.0, HEIGHT)
        likelihood = np.zeros((300, 500), np.uint8)
        x = round(150 + left + speed * number)
        likelihood[100 + top : 100 + top + drawn.shape[0], x : x + drawn.shape[1]] = drawn
        likelihood = np.ascontiguousarray(likelihood[100:220, 150:390])
        around = Box.around(likelihood > 127)
        assert around is not None
        seconds = 1 + PERIOD * number
        box = Box.from_center(
            around.center_x, around.center_y, wider * around.width, around.height
        )
        if watch is None:
            candidate = Candidate(1, box, seconds, seconds)
            watch = Watch(light_bank(small_bank()), config, candidate)
        candidate.box, candidate.seen = box, seconds
        candidate.note(seconds, (0.0, 0.0))
        if watch.due(seconds):
            place = watch.update(likelihood, candidate, round(1e9 * seconds))
            found += [] if place is None else [place]
    return found


def test_a_walker_is_found_with_a_tight_box() -> None:
    box = watched()[0]
    assert abs(box.height - HEIGHT) < 6


def test_who_stays_in_place_is_not_found_though_the_legs_move() -> None:
    # Some way must be seen also of who walks in step; the box of swinging legs moves a little.
    assert watched(speed=0.0, least_way=0.6) == []
    assert watched(speed=0.0, least_way=0.0)


def test_what_is_far_wider_than_a_body_is_nobody() -> None:
    assert watched(wider=4.0) == []


def test_who_is_cut_off_by_the_border_is_waited_for() -> None:
    assert watched(top=-35) == []
    assert watched(top=60) == []


def shown(shape: np.ndarray) -> np.ndarray:
    """Return (120, 160) uint8 with a silhouette in the middle."""
    out = np.zeros((120, 160), np.uint8)
    out[15 : 15 + shape.shape[0], 80 - shape.shape[1] // 2 :][:, : shape.shape[1]] = shape
    return out


def walking(seconds: float) -> np.ndarray:
    return shown(render_silhouette(0.9 * seconds % 1, 0.0, TALL))


def swinging(seconds: float) -> np.ndarray:
    """Return a figure that hangs on its head."""
    turn = cv2.getRotationMatrix2D((80.0, 15.0), 12 * np.sin(2 * np.pi * 0.9 * seconds), 1.0)
    figure = shown(render_silhouette(0.25, 0.0, TALL))
    return np.asarray(cv2.warpAffine(figure, turn, (160, 120)))


def growing(seconds: float) -> np.ndarray:
    """Return a figure that becomes broader and thinner as a whole."""
    broad = 1 + 0.4 * np.sin(2 * np.pi * 0.9 * seconds)
    figure = shown(render_silhouette(0.0, 0.0, TALL))
    move = np.array([[broad, 0, 80 - 80 * broad], [0, 1.0, 0]])
    return np.asarray(cv2.warpAffine(figure, move, (160, 120)))


def seconds_until_found(
    look: Callable[[float], np.ndarray], way: float, trunk: float = 0.0, seconds: float = 3.0
) -> float | None:
    """
    Watch a figure that stays where it is.

    :param way: what it has come, in body heights.
    :param trunk: by how much its trunk flickers.
    :returns: after how many seconds it is found to walk, None if it is not.
    """
    rng = np.random.default_rng(1)
    found: Watch | None = None
    candidate: Candidate | None = None
    for number in range(round(seconds / PERIOD)):
        now = 1 + number * PERIOD
        likelihood = look(number * PERIOD)
        patches = rng.uniform(size=(8, 10)) < trunk
        flicker = cv2.resize(patches.astype(np.uint8), (160, 40), interpolation=cv2.INTER_NEAREST)
        likelihood[35:60, 60:100] ^= 255 * flicker[:25, 60:100]
        box = Box.around(likelihood > 127)
        assert box is not None
        if candidate is None or found is None:
            candidate = Candidate(1, box, now, now)
            found = Watch(light_bank(small_bank()), StartingConfig(watch=0.5), candidate)
        candidate.box, candidate.seen = box, now
        candidate.way.append((now, number * way * TALL * PERIOD / 1.5, 0.0, float(TALL)))
        while len(candidate.way) > 50:
            candidate.way.popleft()
        if found.due(now) and found.update(likelihood, candidate, round(1e9 * now)) is not None:
            return now - 1
    return None


def test_who_walks_in_step_need_not_come_far(monkeypatch: pytest.MonkeyPatch) -> None:
    found = seconds_until_found(walking, 0.12)
    assert found is not None
    assert found < 1.5
    assert seconds_until_found(walking, 0.0) is None
    monkeypatch.setattr(watching, '_STEP_WAY', 1.0)
    assert seconds_until_found(walking, 0.12) is None


def test_what_swings_or_grows_on_the_spot_does_not_walk_in_step() -> None:
    for pace in (0.7, 1.2):
        assert (
            seconds_until_found(lambda seconds, pace=pace: swinging(pace * seconds), 0.12) is None
        )
        assert (
            seconds_until_found(lambda seconds, pace=pace: growing(pace * seconds), 0.12) is None
        )


def test_the_trunk_of_who_walks_in_step_may_change_too(monkeypatch: pytest.MonkeyPatch) -> None:
    assert seconds_until_found(walking, 0.3, trunk=0.2, seconds=2.0) is not None
    monkeypatch.setattr(watching, '_LEAST_ACCORD', 2.0)
    assert seconds_until_found(walking, 0.3, trunk=0.2, seconds=2.0) is None
