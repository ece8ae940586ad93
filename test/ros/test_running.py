# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The exit code of a node, its command line and its parameter files."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.ros.running import (
    remove_dead_segments,
    run_node,
    silence_opencv,
    unused_files,
)


@pytest.mark.parametrize(('words', 'code'), [(['--help'], 0), (['--rate', '3'], 2)])
def test_the_usage_is_shown_instead_of_a_start(words: list[str], code: int, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        run_node(MatcherNode, ['node', *words, '--ros-args', '-p', 'a:=1'])
    assert end.value.code == code
    said = capsys.readouterr()
    assert '--params-file FILE' in said.out + said.err
    assert ('exit code: 0' in said.out) == (code == 0)


@pytest.mark.parametrize(
    ('content', 'found'),
    [
        ('gait_trakker:\n  ros__parameters:\n    max_people: 2', 'gait_trakker'),
        ('gait_tracker:\n  ros_parameters:\n    max_people: 2', 'gait_tracker'),
        ('', 'no keys'),
        # What serves the node, or another one of this package.
        ('/**:\n  ros__parameters:\n    max_people: 2', None),
        ('robot1:\n  gait_matcher:\n    ros__parameters:\n      max_people: 2', None),
        ('/robot1/door:\n  ros__parameters:\n    max_people: 2', None),
    ],
)
def test_a_parameter_file_that_sets_nothing_is_named_with_its_keys(
    tmp_path: Path, content: str, found: str | None
) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text(content)
    said = list(unused_files(['node', '--ros-args', '--params-file', str(file)], 'door'))
    if found is None:
        assert not said
    else:
        (text,) = said
        assert str(file) in text
        assert found in text
        assert '"door:"' in text
        assert 'ros__parameters' in text


def test_opencv_prints_nothing_of_what_it_cannot_decode(capfd) -> None:
    tiff = cv2.imencode('.tiff', np.zeros((32, 32, 3), np.uint8))[1]
    level = getattr(cv2, 'getLogLevel', None) or cv2.utils.logging.getLogLevel
    before = level()
    silence_opencv()
    try:
        assert cv2.imdecode(tiff[: len(tiff) // 2], cv2.IMREAD_COLOR) is None
    finally:
        (getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel)(before)
    assert capfd.readouterr() == ('', '')


def segment(folder: Path, name: str, old: bool = True) -> Path:
    """Make a segment of Fast DDS and its lock."""
    (folder / name).touch()
    lock = folder / f'{name}_el'
    lock.touch()
    if old:
        os.utime(lock, (1, 1))
    return lock


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


def test_only_segments_that_nobody_holds_are_removed(tmp_path: Path, monkeypatch) -> None:
    dead, alive, young, linked = (f'fastrtps_{digit * 16}' for digit in 'abcd')
    segment(tmp_path, dead)
    segment(tmp_path, young, old=False)
    lock = segment(tmp_path, alive)
    # Ports are Fast DDS's own to clean up, and the rest is none of its.
    for other in ('fastrtps_port7411', 'sem.fastrtps_port7411_mutex', 'fastrtps_short', 'mine'):
        segment(tmp_path, other)
    link = tmp_path / f'{linked}_el'
    link.symlink_to(tmp_path / 'elsewhere')
    os.utime(link, (1, 1), follow_symlinks=False)
    before = names(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, 'geteuid', lambda: 12345678)
        remove_dead_segments(tmp_path)
    assert names(tmp_path) == before
    with open(lock, 'rb') as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        remove_dead_segments(tmp_path)
        assert names(tmp_path) == before - {dead, f'{dead}_el'}
    (tmp_path / alive).unlink()
    remove_dead_segments(tmp_path)
    assert names(tmp_path) == before - {dead, f'{dead}_el', alive, f'{alive}_el'}
    remove_dead_segments(tmp_path / 'none')
