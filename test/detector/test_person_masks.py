# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
import subprocess
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.detector import person_masks
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.person_masks import PersonMasks, fetch, network_file
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
    return PersonMasks(tmp_path / 'net.tflite')


def scene(*boxes):
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    for box in boxes:
        image[box.slices(SIZE, SIZE)] = (0, 0, 255)
    return image


def overlap(person, box, scale=1.0, shift=(0.0, 0.0)):
    """Return how alike a mask and a box are, at another scale and so far on."""
    side = round(SIZE * scale)
    found = person.mask.drawn((slice(0, side), slice(0, side)), scale, shift) > 127
    expected = np.zeros((side, side), np.bool_)
    expected[box.scaled(scale).shifted(*shift).slices(side, side)] = True
    return (expected & found).sum() / (expected | found).sum()


@pytest.mark.parametrize(
    ('scale', 'shift'), [(1.0, (0.0, 0.0)), (0.5, (0.0, 0.0)), (2.0, (9, -5))]
)
def test_everybody_who_is_seen_is_drawn_where_they_are(drawer, scale, shift):
    # One reaches over the border.
    boxes = Box(20, 60, 40, 120), Box(150, 100, 60, 180), Box(270, 10, 60, 80)
    seen, drawn = drawer.draw(scene(*boxes), (), [Detection(each, 0.9) for each in boxes])
    assert drawn == ()
    for person, box in zip(seen, boxes, strict=True):
        assert person.box == box
        assert overlap(person, box, scale, shift) > 0.9


def test_each_has_a_mask_of_their_own_and_no_more_than_is_about_their_box(drawer):
    own, other = Box(20, 60, 40, 120), Box(120, 60, 40, 120)
    seen, _ = drawer.draw(scene(own, other), (), [Detection(own, 0.9), Detection(other, 0.9)])
    for person, box in zip(seen, (own, other), strict=True):
        assert overlap(person, box) > 0.9


def test_who_is_known_is_drawn_whether_they_are_seen_or_not(drawer):
    box, off = Box(60, 60, 40, 120), Box(66, 63, 40, 120)
    _, (person,) = drawer.draw(scene(box), [off], None)
    assert (person.score, person.box.iou(box)) == (0.0, pytest.approx(1, abs=0.1))
    assert overlap(person, box) > 0.9
    # The box of the mask is no better if there is hardly anything in it.
    _, (person,) = drawer.draw(scene(), [off], [])
    assert person.box == off
    (person,), drawn = drawer.draw(scene(box), [off], [Detection(box, 0.3)])
    assert (drawn, person.box) == ((), box)
    assert person.mask is not None


@pytest.mark.parametrize(('score', 'is_drawn'), [(0.3, False), (0.5, True)])
def test_who_is_new_must_be_seen_clearly(drawer, score, is_drawn):
    box = Box(20, 60, 40, 120)
    (person,), _ = drawer.draw(scene(box), (), [Detection(box, score)])
    assert (person.mask is not None) == is_drawn


def test_only_so_many_are_drawn_those_who_are_known_first(drawer):
    boxes = [Box(10 + 40 * k, 60, 30, 120) for k in range(7)]
    known, rest = boxes[:4], [Detection(each, 0.9) for each in boxes[4:]]
    seen, drawn = drawer.draw(scene(*boxes), known, rest)
    assert len(drawn) == 4
    assert [each.mask is not None for each in seen] == [True, False, False]


def test_without_the_network_it_is_said_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    with pytest.raises(DetectorError, match=r'is missing: gait_warm_up --people'):
        PersonMasks()
    (tmp_path / 'gait_segmentation').mkdir()
    network_file().write_text('no network')
    with pytest.raises(DetectorError, match='cannot load'):
        PersonMasks()


def test_it_is_fetched_once_and_only_if_it_is_the_one(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    asked = []

    def run(command, **_):
        asked.append(command)
        if len(asked) == 1:
            return subprocess.CompletedProcess(command, 1, '', 'warning\nno network here\n')
        folder = Path(command[command.index('--dest') + 1])
        with zipfile.ZipFile(folder / 'mediapipe-0.10.14.whl', 'w') as wheel:
            wheel.writestr(person_masks._MEMBER, b'text' if len(asked) == 2 else b'network')
        return subprocess.CompletedProcess(command, 0, '', '')

    monkeypatch.setattr(subprocess, 'run', run)

    digest = hashlib.sha256(b'network').hexdigest()
    monkeypatch.setattr(person_masks, '_SHA256', digest)
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
