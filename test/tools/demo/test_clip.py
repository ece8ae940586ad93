# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
import zipfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from gait_segmentation.errors import SequenceError
from gait_tools.cli import demo

FILM = b'a film'


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    return tmp_path / 'cache/gait_segmentation'


@pytest.fixture
def fetched(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the folders that a wheel with the film expected was fetched into."""
    calls: list[str] = []

    def fetch(words: list[str], **_: object) -> SimpleNamespace:
        calls.append(words[-1])
        with zipfile.ZipFile(f'{words[-1]}/sports2d.whl', 'w') as archive:
            archive.writestr(demo._MEMBER, FILM)
        return SimpleNamespace(returncode=0)

    monkeypatch.setattr(demo.subprocess, 'run', fetch)
    monkeypatch.setattr(demo, '_SHA256', hashlib.sha256(FILM).hexdigest())
    return calls


def test_the_clip_is_fetched_once_and_again_if_it_is_damaged(fetched, cache: Path) -> None:
    first = demo.demo_clip()
    assert first.read_bytes() == FILM
    assert demo.demo_clip() == first
    assert len(fetched) == 1
    assert list(cache.iterdir()) == [first]
    first.write_bytes(b'damaged')
    assert demo.demo_clip().read_bytes() == FILM


def test_another_film_is_refused(fetched, cache: Path, monkeypatch) -> None:
    monkeypatch.setattr(demo, '_SHA256', 'ab' * 32)
    with pytest.raises(SequenceError, match='not the film expected'):
        demo.demo_clip()
    assert not cache.exists()


def test_without_a_network_the_message_names_the_way_out(monkeypatch) -> None:
    # Nobody listens on the discard port.
    monkeypatch.setenv('PIP_INDEX_URL', 'http://127.0.0.1:9/simple')
    monkeypatch.setenv('PIP_CONFIG_FILE', '/dev/null')
    monkeypatch.delenv('PIP_EXTRA_INDEX_URL', raising=False)
    monkeypatch.delenv('PIP_FIND_LINKS', raising=False)
    with pytest.raises(SequenceError, match='gait_demo --clip FILE'):
        demo.demo_clip()
