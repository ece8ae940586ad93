# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.files.output_files import keep_apart, named, problem_of, write_file
from gait_tools.outputs import write_picture


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let files grow to some bytes only, as if the disk were full then."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def places(tmp_path: Path) -> Path:
    """Return a folder with a film, a folder of images, and links to them."""
    (tmp_path / 'film.mp4').write_bytes(b'film')
    (tmp_path / 'images').mkdir()
    (tmp_path / 'images/0.png').write_bytes(b'image')
    (tmp_path / 'other').mkdir()
    (tmp_path / 'link.mp4').symlink_to('film.mp4')
    (tmp_path / 'hard.mp4').hardlink_to(tmp_path / 'film.mp4')
    (tmp_path / 'way').symlink_to('images')
    return tmp_path


@pytest.mark.parametrize('output', ['film.mp4', 'link.mp4', 'hard.mp4', 'way/../film.mp4'])
def test_an_output_that_is_an_input_is_refused(places: Path, output: str) -> None:
    with pytest.raises(ConfigError, match=r'--csv .* is the input .*film\.mp4'):
        keep_apart([('--csv', places / output)], [places / 'film.mp4'])


@pytest.mark.parametrize('output', ['images/masks', 'way/masks/more', 'images/0.png'])
def test_an_output_in_an_input_is_refused(places: Path, output: str) -> None:
    with pytest.raises(ConfigError, match='lies in the input'):
        keep_apart([('--masks', places / output)], [places / 'other', places / 'images'])


@pytest.mark.parametrize('source', ['images/0.png', 'way/0.png'])
def test_an_output_that_holds_an_input_is_refused(places: Path, source: str) -> None:
    with pytest.raises(ConfigError, match='holds the input'):
        keep_apart([('--masks', places / 'images')], [places / source])


def test_outputs_beside_inputs_are_taken(places: Path) -> None:
    outputs = [('--out', places / 'film'), ('--csv', None), ('--masks', places / 'images2')]
    keep_apart(outputs, [places / 'film.mp4', places / 'images', places / 'missing'])


def test_links_in_a_circle_are_no_input(places: Path) -> None:
    (places / 'round').symlink_to('round')
    keep_apart([('--out', places / 'other'), ('--csv', places / 'round')], [places / 'film.mp4'])


def test_errors_get_the_name_of_their_file_unless_they_have_one() -> None:
    with pytest.raises(OSError, match='full') as caught, named('a.csv'):
        raise OSError(28, 'full')
    assert problem_of(caught.value) == 'a.csv: full'
    with pytest.raises(OSError, match='full') as caught, named('a.csv'):
        raise OSError(28, 'full', 'b.csv')
    assert problem_of(caught.value) == 'b.csv: full'
    assert problem_of(OSError('in words')) == 'in words'


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / 'scores.json'
    write_file(path, b'before')
    with room_for(100), pytest.raises(OSError, match='File too large') as caught:
        write_file(path, bytes(1000))
    assert caught.value.filename == str(path)
    assert path.read_bytes() == b'before'
    assert os.listdir(tmp_path) == ['scores.json']


def test_a_link_is_replaced_and_what_it_leads_to_kept(tmp_path: Path) -> None:
    (tmp_path / 'truth.png').write_bytes(b'truth')
    (tmp_path / 'mask.png').symlink_to('truth.png')
    write_file(tmp_path / 'mask.png', b'mask')
    assert (tmp_path / 'truth.png').read_bytes() == b'truth'
    assert (tmp_path / 'mask.png').read_bytes() == b'mask'


def test_a_device_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    write_file(Path(os.devnull), b'lost')
    assert Path(os.devnull).is_char_device()
    with pytest.raises(OSError, match='No space left') as caught:
        write_file(Path('/dev/full'), b'lost')
    assert caught.value.filename == '/dev/full'


def test_a_picture_of_no_known_format_is_an_error_that_says_what_is(tmp_path: Path) -> None:
    with pytest.raises(SequenceError, match=r'a\.xyz cannot be written: its name must end in'):
        write_picture(tmp_path / 'a.xyz', np.zeros((2, 2), np.uint8))
    assert os.listdir(tmp_path) == []
