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
    segment(tmp_path, 'fastrtps_port7411')
    before = names(tmp_path)
    monkeypatch.setattr(os, 'geteuid', lambda: 12345678)
    assert remove_dead_segments(tmp_path) == 0
    DeadPorts(tmp_path).close()
    assert names(tmp_path) == before
    assert (tmp_path / 'fastrtps_port7411').is_file()
    assert remove_dead_segments(tmp_path / 'none') == 0
    DeadPorts(tmp_path / 'none').close()


def test_the_ports_of_the_dead_are_closed_and_their_numbers_free_again_later(
    tmp_path: Path,
) -> None:
    dead = segment(tmp_path, 'fastrtps_port7411')
    alive = segment(tmp_path, 'fastrtps_port7413')
    looked_at = segment(tmp_path, 'fastrtps_port7415', old=False)
    left = {'fastrtps_port7415', looked_at.name}
    with open(alive, 'rb') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        ports = DeadPorts(tmp_path)
        assert (tmp_path / 'fastrtps_port7411').is_dir()
        assert names(tmp_path) == left | {'fastrtps_port7411', 'fastrtps_port7413', alive.name}
        assert not dead.exists()
    ports.look()
    assert (tmp_path / 'fastrtps_port7413').is_dir()
    ports.close()
    # Others may still write there.
    assert names(tmp_path) == left | {'fastrtps_port7411', 'fastrtps_port7413'}
    DeadPorts(tmp_path, closed_s=0.0)
    assert names(tmp_path) == left


def test_those_who_die_later_are_found_and_their_numbers_are_free_again_after_a_while(
    tmp_path: Path,
) -> None:
    ports = DeadPorts(tmp_path, closed_s=0.0)
    ports.start()
    segment(tmp_path, 'fastrtps_port7411')
    while names(tmp_path):
        time.sleep(0.01)
    ports.close()


def test_a_port_that_is_made_anew_meanwhile_is_closed_nevertheless(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    segment(tmp_path, 'fastrtps_port7411')
    port = tmp_path / 'fastrtps_port7411'
    unlink, again = Path.unlink, [True]

    def made_anew(path: Path, missing_ok: bool = False) -> None:
        unlink(path, missing_ok=missing_ok)
        if path == port and again:
            again.clear()
            port.touch()

    monkeypatch.setattr(Path, 'unlink', made_anew)
    DeadPorts(tmp_path)
    assert port.is_dir()
    assert names(tmp_path) == {port.name}


def test_ports_without_a_lock_are_closed_at_the_start_alone(tmp_path: Path) -> None:
    """Later they may be about to be read."""
    written, shared, later = (f'fastrtps_port741{n}' for n in (1, 3, 5))
    for name in (written, shared):
        segment(tmp_path, name).unlink()
    (tmp_path / f'{shared}_sl').touch()
    before = names(tmp_path)
    ports = DeadPorts(tmp_path)
    assert names(tmp_path) == before
    segment(tmp_path, later).unlink()
    ports.look()
    assert [name for name in (written, shared, later) if (tmp_path / name).is_dir()] == [written]
    ports.close()
