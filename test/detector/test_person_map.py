# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
import subprocess
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.detector import person_map
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.detector.person_map import PersonMap, fetch, network_file
from gait_segmentation.errors import DetectorError
from gait_segmentation.geometry import Box

SIZE = 300


class Red:
    """A network that takes for a person what is red."""

    def __init__(self, path):
        assert Path(path).read_bytes() == b'network'

    def setInput(self, blob):  # noqa: N802
        assert blob.shape == (1, 3, 256, 256)
        self.seen = blob

    def forward(self, name):
        assert name == 'Identity_2'
        return 2000 * (self.seen[:, :1] - 0.5)


@pytest.fixture
def drawer(tmp_path, monkeypatch):
    monkeypatch.setattr(cv2.dnn, 'readNetFromTFLite', Red, raising=False)
    (tmp_path / 'net.tflite').write_bytes(b'network')
    return PersonMap(tmp_path / 'net.tflite')


def scene(*boxes):
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    for box in boxes:
        image[box.slices(SIZE, SIZE)] = (0, 0, 255)
    return image


def overlap(drawn, *boxes):
    expected, found = scene(*boxes)[..., 2] > 0, drawn > 127
    return (expected & found).sum() / (expected | found).sum()


def test_everybody_who_is_seen_is_drawn_where_they_are(drawer):
    # One reaches over the border.
    boxes = Box(20, 60, 40, 120), Box(150, 100, 60, 180), Box(270, 10, 60, 80)
    drawn = drawer.draw(scene(*boxes), [Detection(each, 0.9) for each in boxes])
    assert drawn.dtype == np.uint8
    assert overlap(drawn, *boxes) > 0.95
    # What nobody was seen at is nobody.
    assert not drawer.draw(scene(*boxes), []).any() or overlap(drawn, *boxes) > 0.95
    drawer.reset()
    assert not drawer.draw(scene(*boxes), []).any()


def test_between_two_looks_people_are_followed_by_what_is_drawn(drawer):
    box = Box(20, 60, 40, 120)
    drawer.draw(scene(box), [Detection(box, 0.9)])
    for _ in range(20):
        box = box.shifted(8, 0)
        drawn = drawer.draw(scene(box), None)
        assert overlap(drawn, box) > 0.95


@pytest.mark.parametrize(('score', 'before', 'drawn'), [(0.3, False, False), (0.3, True, True)])
def test_who_was_there_before_need_not_be_seen_so_clearly(drawer, score, before, drawn):
    box = Box(20, 60, 40, 120)
    if before:
        drawer.draw(scene(box), [Detection(box, 0.9)])
    for _ in range(5):
        found = drawer.draw(scene(box), [Detection(box.shifted(5, 5), score)])
    assert found.any() == drawn


def test_who_is_not_seen_three_times_is_gone(drawer):
    box = Box(20, 60, 40, 120)
    drawer.draw(scene(box), [Detection(box, 0.9)])
    assert [drawer.draw(scene(box), []).any() for _ in range(3)] == [True, True, False]


def test_without_the_network_it_is_said_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    with pytest.raises(DetectorError, match=r'is missing: gait_warm_up --people'):
        PersonMap()
    (tmp_path / 'gait_segmentation').mkdir()
    network_file().write_text('no network')
    with pytest.raises(DetectorError, match='cannot load'):
        PersonMap()


def test_it_is_fetched_once_and_only_if_it_is_the_one(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    asked = []

    def run(command, **_):
        asked.append(command)
        if len(asked) == 1:
            return subprocess.CompletedProcess(command, 1, '', 'warning\nno network here\n')
        folder = Path(command[command.index('--dest') + 1])
        with zipfile.ZipFile(folder / 'mediapipe-0.10.14.whl', 'w') as wheel:
            wheel.writestr(person_map._MEMBER, b'text' if len(asked) == 2 else b'network')
        return subprocess.CompletedProcess(command, 0, '', '')

    monkeypatch.setattr(subprocess, 'run', run)

    digest = hashlib.sha256(b'network').hexdigest()
    monkeypatch.setattr(person_map, '_SHA256', digest)
    with pytest.raises(
        DetectorError, match=r'pip cannot fetch mediapipe==0\.10\.14: no network here'
    ):
        fetch()
    with pytest.raises(DetectorError, match='is not what was expected'):
        fetch()
    assert not network_file().exists()
    assert fetch() == fetch() == network_file()
    assert network_file().read_bytes() == b'network'
    assert len(asked) == 3
    assert [each.name for each in network_file().parent.iterdir()] == [network_file().name]
