# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import numpy as np
import pytest

from gait_segmentation.cli.replaying.walks import Walks
from test.cli.replaying.results import STEP_NS, replayed
from test.cli.replaying.test_opengait import figure

RATE = 0.9
"""Strides a second, of the results made up."""


def walks_of(frames: int, step_px: int, azimuth: float = 0.0) -> Walks:
    walks = Walks()
    for index in range(frames):
        walks.add(replayed(index, [(3, figure(step_px * index, 40), azimuth)]))
    return walks


def test_a_walk_has_its_direction_cadence_speed_and_confidence() -> None:
    (walk,) = walks_of(40, 4, math.pi - 0.1).all()
    assert (walk.person, walk.walk, walk.frames) == (3, '180', 40)
    assert walk.direction_rad == pytest.approx(math.pi - 0.1, abs=1e-4)
    assert walk.cadence_steps_per_min == pytest.approx(120 * RATE)
    assert walk.speed_heights_per_s == pytest.approx(4e9 / STEP_NS / 128, rel=0.01)
    assert walk.confidence == pytest.approx(0.7)


def test_directions_are_averaged_on_the_circle() -> None:
    walks = Walks()
    for index in range(10):
        azimuth = math.pi - 0.2 if index % 2 else 0.2 - math.pi
        walks.add(replayed(index, [(1, figure(10, 40), azimuth)]))
    (walk,) = walks.all()
    assert abs(walk.direction_rad) == pytest.approx(math.pi, abs=1e-3)


def test_the_speed_of_what_ends_within_a_second_is_not_known() -> None:
    (walk,) = walks_of(20, 4).all()
    assert walk.speed_heights_per_s is None


def test_short_walks_and_what_is_hardly_seen_are_left_out() -> None:
    walks = walks_of(4, 4)
    for index in range(40):
        walks.add(replayed(index, [(4, figure(0, 3, height=13), 0.0)]))
        walks.add(replayed(index, [(0, np.zeros((200, 300), np.uint8), 0.0)]))
    assert walks.all() == []
