# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

from gait_segmentation.cli.replaying.walks import (
    OpenGaitOutput,
    Walks,
    normalised,
)
from test.cli.replaying.results import replayed

RATE = 0.9
"""Strides a second, of the results made up."""


def figure(left: int, width: int, top: int = 20, height: int = 128) -> np.ndarray:
    mask = np.zeros((200, 300), np.uint8)
    mask[top : top + height, left : left + width] = 255
    return mask


def test_a_silhouette_fills_the_height_and_stands_in_the_middle() -> None:
    silhouette = normalised(figure(100, 40))
    expected = np.zeros((64, 64), np.uint8)
    expected[:, 22:42] = 255
    assert silhouette.dtype == np.uint8
    # The centre is a whole column, and cubic interpolation rings at edges.
    assert abs(silhouette.astype(int) - expected).max(axis=0)[24:40].max() == 0
    assert (silhouette > 127).sum(axis=1).tolist() == [20] * 64
    # At the border the rest is empty, and wide ones are cut off.
    for left in (0, 260):
        assert abs(int((normalised(figure(left, 40)) > 127).sum()) - 20 * 64) <= 64
    assert (normalised(figure(0, 300)) > 127).all()


def test_walks_are_written_by_person_and_direction(tmp_path: Path) -> None:
    output = OpenGaitOutput(tmp_path / 'walk')
    for index in range(6):
        people = [(3, figure(10 * index, 40), math.pi - 0.1)]
        if index < 4:
            people.append((4, figure(200, 40), 0.0))
        output.add(*replayed(index, people))
    output.close(complete=True)
    (file,) = (tmp_path / 'walk').rglob('*.*')
    assert file == tmp_path / 'walk/person-003/180/180.pkl'
    walk = pickle.loads(file.read_bytes())
    assert (walk.shape, walk.dtype) == ((6, 64, 64), np.uint8)
    assert [p.name for p in tmp_path.iterdir()] == ['walk']


def walks_of(frames: int, step_px: int, azimuth: float = 0.0) -> Walks:
    walks = Walks()
    for index in range(frames):
        walks.add(replayed(index, [(3, figure(step_px * index, 40), azimuth)]).result)
    return walks


def test_a_walk_has_its_direction_cadence_and_confidence() -> None:
    (walk,) = walks_of(40, 4, math.pi - 0.1).all()
    assert (walk.person, walk.walk, walk.frames) == (3, '180', 40)
    assert walk.direction_rad == pytest.approx(math.pi - 0.1, abs=1e-4)
    assert walk.cadence_steps_per_min == pytest.approx(120 * RATE)
    assert walk.confidence == pytest.approx(0.7)


def test_directions_are_averaged_on_the_circle() -> None:
    walks = Walks()
    for index in range(10):
        azimuth = math.pi - 0.2 if index % 2 else 0.2 - math.pi
        walks.add(replayed(index, [(1, figure(10, 40), azimuth)]).result)
    (walk,) = walks.all()
    assert abs(walk.direction_rad) == pytest.approx(math.pi, abs=1e-3)


def test_short_walks_and_what_is_hardly_seen_are_left_out() -> None:
    walks = walks_of(4, 4)
    for index in range(40):
        walks.add(replayed(index, [(4, figure(0, 3, height=13), 0.0)]).result)
        walks.add(replayed(index, [(0, np.zeros((200, 300), np.uint8), 0.0)]).result)
    assert walks.all() == []
