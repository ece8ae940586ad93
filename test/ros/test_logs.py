# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gait_segmentation.ros.participant import log_where_possible

NAMES = ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in NAMES:
        monkeypatch.setenv(name, '')
        monkeypatch.delenv(name)
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))


@pytest.mark.parametrize('name', NAMES)
def test_logs_stay_where_they_can_be_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(name, str(tmp_path / 'there'))
    before = dict(os.environ)
    log_where_possible()
    assert dict(os.environ) == before
    assert capfd.readouterr().err == ''


@pytest.mark.parametrize('name', [None, *NAMES])
def test_a_node_starts_where_it_can_write_no_logs_and_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str | None
) -> None:
    # A file in the way: also root cannot write there.
    (tmp_path / 'file').touch()
    if name is not None:
        monkeypatch.setenv(name, str(tmp_path / 'file'))
    code = (
        'from gait_segmentation.ros.participant import take_part\n'
        'from rclpy.logging import get_logger\n'
        'part = take_part([])\n'
        'get_logger("somebody").error("something")\n'
        'part.close()'
    )
    environment = {**os.environ, 'TMPDIR': str(tmp_path), 'PYTHONPATH': os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, '-c', code], env=environment, capture_output=True, text=True, check=True
    )
    said = [line for line in done.stderr.splitlines() if 'logs cannot be written' in line]
    assert len(said) == 1
    (log,) = tmp_path.glob('ros_log_*/*')
    assert 'something' in log.read_text()
