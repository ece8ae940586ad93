# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The detector's process and who talks to it: the real script, with a mediapipe that is none."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from gait_segmentation.detector import client
from gait_segmentation.detector.client import PYTHON, Detector, detector_python
from gait_segmentation.errors import ConfigError, DetectorError, InputError
from test.detectors import ENDLESS, FATAL, fake_python, image


@pytest.fixture
def python(tmp_path: Path) -> str:
    return fake_python(tmp_path)


def test_a_map_is_what_the_network_says_of_the_image(python: str) -> None:
    with Detector(python) as detector:
        np.testing.assert_array_equal(detector.map_of(image()), image()[..., 2])
        # Nothing waits to end the network.
        assert not [
            each
            for each in threading.enumerate()
            if isinstance(each, threading.Timer) and not each.finished.is_set()
        ]
        blank = detector.map_of(np.zeros((30, 40, 3), np.uint8))
        assert blank.shape == (30, 40)
        assert not blank.any()
        with pytest.raises(InputError, match='image must be a'):
            detector.map_of(image()[..., 0])


def test_large_images_are_sent_smaller(python: str) -> None:
    large = np.zeros((500, 1280, 3), np.uint8)
    large[:, 640:, 2] = 255
    with Detector(python) as detector:
        found = detector.map_of(large)
        assert found.shape == (250, 640)
        assert (found[:, :320].max(), found[:, 320:].min()) == (0, 255)
        assert detector.map_of(np.zeros((1, 4000, 3), np.uint8)).shape == (1, 640)


def test_one_that_has_ended_says_why_and_is_started_again(python: str) -> None:
    with Detector(python) as detector:
        for _ in range(2):
            with pytest.raises(DetectorError, match='has ended: out of memory'):
                detector.map_of(image(FATAL))
        assert detector.map_of(image()).any()


def test_one_that_does_not_answer_is_ended(python: str, monkeypatch) -> None:
    monkeypatch.setattr(client, '_MAP_S', 0.5)
    with Detector(python) as detector, pytest.raises(DetectorError, match=r'within 0\.5 s'):
        detector.map_of(image(ENDLESS))


@pytest.mark.parametrize('mediapipe', ["raise ImportError('no such library')", 'solution = None'])
def test_without_a_network_it_is_said_what_helps(tmp_path: Path, mediapipe: str) -> None:
    python = fake_python(tmp_path, mediapipe)
    with Detector(python) as detector, pytest.raises(DetectorError) as raised:
        detector.start()
    assert str(raised.value).startswith(f'the detector ({python}) has ended: ')
    assert '-m pip install mediapipe==0.10.14' in str(raised.value)


def test_the_python_is_the_one_asked_for_or_has_mediapipe(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv('XDG_DATA_HOME', str(tmp_path))
    monkeypatch.delenv(PYTHON, raising=False)
    monkeypatch.setattr(client, 'find_spec', lambda name: None)
    environment = tmp_path / 'gait_segmentation/mediapipe'
    with pytest.raises(ConfigError) as raised:
        detector_python()
    made = f'python3 -m venv {environment} && {environment}/bin/pip install mediapipe==0.10.14'
    assert made in str(raised.value)
    (environment / 'bin').mkdir(parents=True)
    (environment / 'bin/python').symlink_to(sys.executable)
    assert detector_python() == str(environment / 'bin/python')
    monkeypatch.setattr(client, 'find_spec', lambda name: object())
    assert detector_python() == sys.executable
    monkeypatch.setenv(PYTHON, str(environment / 'bin/python'))
    assert detector_python() == os.environ[PYTHON]
    monkeypatch.setenv(PYTHON, 'no-such-python')
    with pytest.raises(ConfigError, match=f'{PYTHON} must be .* got no-such-python'):
        detector_python()
