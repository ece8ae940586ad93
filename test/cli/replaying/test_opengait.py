# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

from gait_segmentation.cli.replaying.opengait import (
    OpenGaitOutput,
    OpenGaitPeopleOutput,
    normalised,
)
from gait_segmentation.errors import SequenceError
from test.cli.replaying.results import replayed


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


@pytest.mark.parametrize('left', [0, 260])
def test_at_the_border_the_rest_is_empty(left: int) -> None:
    silhouette = normalised(figure(left, 40))
    assert silhouette.shape == (64, 64)
    assert abs(int((silhouette > 127).sum()) - 20 * 64) <= 64


def test_wide_ones_are_cut_off() -> None:
    assert (normalised(figure(0, 300)) > 127).all()


def test_walks_are_written_by_person_and_direction(tmp_path: Path) -> None:
    output = OpenGaitOutput(tmp_path / 'walk')
    for index in range(6):
        people = [(3, figure(10 * index, 40), math.pi - 0.1)]
        if index < 4:
            people.append((4, figure(200, 40), 0.0))
        output.add(replayed(index, people))
    output.close(complete=True)
    (file,) = (tmp_path / 'walk').rglob('*.*')
    assert file == tmp_path / 'walk/person-003/180/180.pkl'
    walk = pickle.loads(file.read_bytes())
    assert (walk.shape, walk.dtype) == ((6, 64, 64), np.uint8)
    assert [p.name for p in tmp_path.iterdir()] == ['walk']


def test_everybody_may_be_a_subject(tmp_path: Path) -> None:
    output = OpenGaitPeopleOutput(tmp_path / 'street')
    for index in range(6):
        people = [(3, figure(10 * index, 40), math.pi), (4, figure(200, 40), 0.0)]
        output.add(replayed(index, people))
    output.close(complete=True)
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob('*.pkl')}
    assert files == {
        'street/street-person-003/walk/180/180.pkl',
        'street/street-person-004/walk/000/000.pkl',
    }
    OpenGaitPeopleOutput.check(tmp_path / 'street')
    with pytest.raises(SequenceError, match='is not replaced'):
        OpenGaitOutput.check(tmp_path / 'street')
