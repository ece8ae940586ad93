# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import fcntl
import os
import time
from pathlib import Path

import pytest

from gait_segmentation.ros.shared_memory import DeadPorts, remove_dead_segments


def segment(folder: Path, name: str, old: bool = True) -> Path:
    """Make a segment of 1000 bytes and its lock."""
    (folder / name).write_bytes(bytes(1000))
    lock = folder / f'{name}_el'
    lock.touch()
    if old:
        os.utime(lock, (1, 1))
    return lock


def is_locked(lock: Path) -> bool:
    with open(lock, 'rb') as other:
        try:
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


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
    monkeypatch.setattr(os, 'geteuid', lambda: 12345678)
    assert remove_dead_segments(tmp_path) == 0
    assert len(names(tmp_path)) == 2
    assert remove_dead_segments(tmp_path / 'none') == 0


def test_the_locks_of_the_dead_are_held_and_what_they_have_left_is_removed_later(
    tmp_path: Path,
) -> None:
    dead = segment(tmp_path, 'fastrtps_port7411')
    alive = segment(tmp_path, 'fastrtps_port7413')
    looked_at = segment(tmp_path, 'fastrtps_port7415', old=False)
    with open(alive, 'rb') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        ports = DeadPorts(tmp_path)
        assert is_locked(dead)
        assert not is_locked(looked_at)
    assert not is_locked(alive)
    ports.look()
    assert is_locked(alive)
    assert len(names(tmp_path)) == 6
    ports.close()
    # Others may still write there: who looks next goes on holding them.
    assert len(names(tmp_path)) == 6
    assert not is_locked(dead)
    DeadPorts(tmp_path, hold_s=0.0)
    assert names(tmp_path) == {'fastrtps_port7415', looked_at.name}


def test_those_who_die_later_are_found_and_their_ports_are_free_again_after_a_while(
    tmp_path: Path,
) -> None:
    ports = DeadPorts(tmp_path, hold_s=0.0)
    ports.start()
    segment(tmp_path, 'fastrtps_port7411')
    while names(tmp_path):
        time.sleep(0.01)
    ports.close()


def test_a_port_is_not_held_for_longer_because_who_held_it_died(tmp_path: Path) -> None:
    lock = segment(tmp_path, 'fastrtps_port7411')
    ports = DeadPorts(tmp_path, hold_s=20.0)
    assert time.time() - lock.stat().st_mtime < 20
    found = lock.read_bytes()
    ports.close()
    lock = segment(tmp_path, 'fastrtps_port7411')
    lock.write_bytes(found)
    os.utime(lock, (time.time() - 21, time.time() - 21))
    DeadPorts(tmp_path, hold_s=20.0)
    assert not names(tmp_path)


def test_at_the_start_ports_that_are_only_written_to_are_held(
    tmp_path: Path,
) -> None:
    written, shared = 'fastrtps_port7411', 'fastrtps_port7413'
    for name in (written, shared, 'fastrtps_port7415'):
        segment(tmp_path, name).unlink()
    (tmp_path / f'{shared}_sl').touch()
    os.utime(tmp_path / 'fastrtps_port7415', (1, 1))
    before = names(tmp_path)
    ports = DeadPorts(tmp_path)
    assert names(tmp_path) == before | {f'{written}_el'}
    assert is_locked(tmp_path / f'{written}_el')
    ports.close()
    (tmp_path / f'{written}_el').unlink()
    ports.look()
    assert names(tmp_path) == before


def test_ports_of_somebody_else_are_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock = segment(tmp_path, 'fastrtps_port7411')
    monkeypatch.setattr(os, 'geteuid', lambda: 12345678)
    DeadPorts(tmp_path).close()
    assert names(tmp_path) == {'fastrtps_port7411', lock.name}
    DeadPorts(tmp_path / 'none').close()
