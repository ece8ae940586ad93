# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.files.output_files import keep_apart, named, problem_of, write_file


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
    with pytest.raises(OSError, match='full') as caught, named('a.csv'):
        raise OSError(28, 'full')
    assert problem_of(caught.value) == 'a.csv: full'
    with pytest.raises(OSError, match='full') as caught, named('a.csv'):
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
