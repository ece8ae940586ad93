# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

from gait_segmentation.ros.shared_memory import remove_dead_segments


def segment(folder: Path, name: str, old: bool = True) -> Path:
    """Make a segment of 1000 bytes and its lock."""
    (folder / name).write_bytes(bytes(1000))
    lock = folder / f'{name}_el'
    lock.touch()
    if old:
        os.utime(lock, (1, 1))
    return lock


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


def test_only_what_nobody_holds_is_removed(tmp_path: Path) -> None:
    dead, alive, young = (f'fastrtps_{digit * 16}' for digit in 'abc')
    segment(tmp_path, dead)
    segment(tmp_path, young, old=False)
    lock = segment(tmp_path, alive)
    # Ports are Fast DDS's own to clean up, and the rest is none of its.
    others = ['fastrtps_port7411', 'sem.fastrtps_port7411_mutex', 'fastrtps_short', 'mine']
    for other in others:
        segment(tmp_path, other)
    before = names(tmp_path)
    with open(lock, 'rb') as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert remove_dead_segments(tmp_path) == 1000
        assert names(tmp_path) == before - {dead, f'{dead}_el'}
    assert remove_dead_segments(tmp_path) == 1000
    assert names(tmp_path) == before - {dead, f'{dead}_el', alive, f'{alive}_el'}


def test_a_lock_without_a_segment_is_removed_and_a_link_is_not_followed(tmp_path: Path) -> None:
    segment(tmp_path, 'fastdds_' + 'a' * 16)
    (tmp_path / ('fastdds_' + 'a' * 16)).unlink()
    link = tmp_path / ('fastrtps_' + 'b' * 16 + '_el')
    link.symlink_to(tmp_path / 'elsewhere')
    os.utime(link, (1, 1), follow_symlinks=False)
    assert remove_dead_segments(tmp_path) == 0
    assert names(tmp_path) == {link.name}


def test_what_belongs_to_somebody_else_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    segment(tmp_path, 'fastrtps_' + 'a' * 16)
    before = names(tmp_path)
    monkeypatch.setattr(os, 'geteuid', lambda: 12345678)
    assert remove_dead_segments(tmp_path) == 0
    assert names(tmp_path) == before
    assert remove_dead_segments(tmp_path / 'none') == 0
