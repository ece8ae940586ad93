# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import resource
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.files import (
    keep_apart,
    named,
    prepare,
    problem_of,
    read_yaml,
    shared_file,
    write_file,
)


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let files grow to some bytes only, as if the disk were full then."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(
    ('output', 'source'),
    [
        ('film.mp4', 'film.mp4'),
        ('link.mp4', 'film.mp4'),
        ('way/../film.mp4', 'film.mp4'),
        ('way/masks/more', 'images'),
        ('images', 'way/0.png'),
    ],
)
def test_an_output_that_would_change_an_input_is_refused(
    output: str, source: str, tmp_path: Path
) -> None:
    (tmp_path / 'film.mp4').write_bytes(b'film')
    (tmp_path / 'images').mkdir()
    (tmp_path / 'link.mp4').symlink_to('film.mp4')
    (tmp_path / 'way').symlink_to('images')
    with pytest.raises(ConfigError, match='choose another place'):
        keep_apart([('--csv', tmp_path / output)], [tmp_path / 'missing', tmp_path / source])
    keep_apart([('--csv', None), ('--out', tmp_path / 'film')], [tmp_path / source])


def test_errors_get_the_name_of_their_file_unless_they_have_one() -> None:
    with pytest.raises(OSError) as caught, named('a.csv'):
        raise OSError(28, 'full')
    assert problem_of(caught.value) == 'a.csv: full'
    with pytest.raises(OSError) as caught, named('a.csv'):
        raise OSError(28, 'full', 'b.csv')
    assert problem_of(caught.value) == 'b.csv: full'


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / 'scores.json'
    write_file(path, b'before')
    with room_for(100), pytest.raises(OSError, match='File too large') as caught:
        write_file(path, bytes(1000))
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b'before'
    assert os.listdir(tmp_path) == ['scores.json']


@pytest.mark.parametrize(
    'data',
    [
        b'a: b: c',
        b'a: 2001-99-99',
        b'a: !!python/object:os.system x',
        b'\x00',
        b'\xff\xfe\x00',
        None,
    ],
)
def test_what_is_wrong_with_yaml_is_one_line(tmp_path: Path, data: bytes | None) -> None:
    path = tmp_path / 'a.yaml'
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(ConfigError) as caught:
        read_yaml(path, ConfigError)
    assert str(caught.value).startswith(f'{path} ')
    assert '\n' not in str(caught.value)


PROFILE = 'config/fastdds_shm.xml'


def test_files_are_found_in_an_ament_prefix_or_the_source_tree(tmp_path, monkeypatch) -> None:
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    root = ElementTree.parse(shared_file(PROFILE)).getroot()

    def values(tag: str) -> list[str]:
        return [str(each.text) for each in root.iter() if each.tag.rpartition('}')[2] == tag]

    # A segment for large images, and other machines are reached by UDP.
    assert values('segment_size') == [str(1 << 24)]
    assert values('type') == ['SHM', 'UDPv4']
    assert {*values('transport_id')[2:]} == {*values('transport_id')[:2]}
    file = tmp_path / 'share/gait_segmentation' / PROFILE
    file.parent.mkdir(parents=True)
    file.touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path}')
    assert shared_file(PROFILE) == file
    with pytest.raises(ConfigError, match=r'no\.such'):
        shared_file('no.such')


def test_what_is_set_is_kept() -> None:
    environment = {'FASTDDS_DEFAULT_PROFILES_FILE': '/mine.xml'}
    prepare(environment)
    assert environment['FASTDDS_DEFAULT_PROFILES_FILE'] == '/mine.xml'
    assert 'FASTRTPS_DEFAULT_PROFILES_FILE' not in environment
    environment = {}
    prepare(environment)
    assert environment['FASTDDS_DEFAULT_PROFILES_FILE'].endswith(PROFILE)
