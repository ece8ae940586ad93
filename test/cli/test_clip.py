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
def fetched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the folders that a wheel with the film expected was fetched into."""
    path, calls = tmp_path / 'sports2d.whl', []
    with zipfile.ZipFile(path, 'w') as archive:
        archive.writestr(clip._MEMBER, FILM)
    monkeypatch.setattr(clip, '_SHA256', hashlib.sha256(FILM).hexdigest())
    monkeypatch.setattr(clip, '_wheel', lambda folder: calls.append(folder) or path)
    return calls


def test_the_clip_is_fetched_once_and_again_if_it_is_damaged(fetched, tmp_path) -> None:
    cache = tmp_path / 'cache'
    first = clip.demo_clip(cache)
    assert first.read_bytes() == FILM
    assert clip.demo_clip(cache) == first
    assert len(fetched) == 1
    assert [path.name for path in cache.iterdir()] == [first.name]
    first.write_bytes(b'damaged')
    assert clip.demo_clip(cache).read_bytes() == FILM


def test_another_film_is_refused(fetched, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(clip, '_SHA256', 'ab' * 32)
    with pytest.raises(SequenceError, match='not the film expected'):
        clip.demo_clip(tmp_path / 'cache')
    assert not (tmp_path / 'cache').exists()


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
