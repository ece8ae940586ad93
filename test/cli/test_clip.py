# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

import pytest

from gait_segmentation.cli import clip
from gait_segmentation.errors import SequenceError

FILM = b'a film'


@pytest.fixture
def wheel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a wheel with a film, which is what is expected."""
    path = tmp_path / 'sports2d.whl'
    with zipfile.ZipFile(path, 'w') as archive:
        archive.writestr(clip._MEMBER, FILM)
    expect(monkeypatch, path, FILM)
    return path


def expect(monkeypatch: pytest.MonkeyPatch, wheel: Path, film: bytes) -> None:
    monkeypatch.setattr(clip, '_WHEEL_SHA256', hashlib.sha256(wheel.read_bytes()).hexdigest())
    monkeypatch.setattr(clip, '_CLIP_SHA256', hashlib.sha256(film).hexdigest())


def test_the_clip_is_fetched_once(wheel, tmp_path, monkeypatch) -> None:
    calls = []
    monkeypatch.setattr(clip, '_download', lambda folder: calls.append(folder) or wheel)
    cache = tmp_path / 'cache'
    first = clip.demo_clip(cache)
    assert first.read_bytes() == FILM
    assert clip.demo_clip(cache) == first
    assert len(calls) == 1
    assert [path.name for path in cache.iterdir()] == [first.name]


def test_a_damaged_copy_in_the_cache_is_fetched_again(wheel, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(clip, '_download', lambda folder: wheel)
    path = clip.demo_clip(tmp_path / 'cache')
    path.write_bytes(b'damaged')
    assert clip.demo_clip(tmp_path / 'cache').read_bytes() == FILM


def test_another_wheel_is_refused(wheel, monkeypatch) -> None:
    monkeypatch.setattr(clip, '_WHEEL_SHA256', 'ab' * 32)
    with pytest.raises(SequenceError, match='must have the SHA-256 abab'):
        clip.clip_of_wheel(wheel)


def test_another_film_is_refused(wheel, monkeypatch) -> None:
    monkeypatch.setattr(clip, '_CLIP_SHA256', 'ab' * 32)
    with pytest.raises(SequenceError, match='not the film expected'):
        clip.clip_of_wheel(wheel)


def test_without_a_network_the_message_names_the_way_out(tmp_path, monkeypatch) -> None:
    # Nobody listens on the discard port.
    monkeypatch.setenv('PIP_INDEX_URL', 'http://127.0.0.1:9/simple')
    monkeypatch.setenv('PIP_CONFIG_FILE', '/dev/null')
    monkeypatch.delenv('PIP_EXTRA_INDEX_URL', raising=False)
    monkeypatch.delenv('PIP_FIND_LINKS', raising=False)
    with pytest.raises(SequenceError, match='gait_demo --clip FILE'):
        clip.demo_clip(tmp_path)


def test_without_a_folder_in_the_environment_it_is_below_home(monkeypatch) -> None:
    for value in (None, '', 'relative/path'):
        if value is None:
            monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
        else:
            monkeypatch.setenv('XDG_CACHE_HOME', value)
        monkeypatch.setenv('HOME', '/home/somebody')
        assert clip.cache_folder() == Path('/home/somebody/.cache/gait_segmentation')
    monkeypatch.setenv('XDG_CACHE_HOME', '/var/cache')
    assert clip.cache_folder() == Path('/var/cache/gait_segmentation')
