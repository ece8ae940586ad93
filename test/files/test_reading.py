# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.files.reading import read_yaml, regular


def test_files_and_links_to_them_may_be_opened(tmp_path: Path) -> None:
    file, link = tmp_path / 'file', tmp_path / 'link'
    file.write_text('words')
    link.symlink_to(file)
    assert regular(file).read_text() == regular(str(link)).read_text() == 'words'


def test_what_may_block_or_never_ends_may_not(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / 'pipe')
    (tmp_path / 'link').symlink_to(tmp_path / 'pipe')
    with socket.socket(socket.AF_UNIX) as opened:
        opened.bind(str(tmp_path / 'socket'))
    wrong = {'pipe': 'a pipe', 'link': 'a pipe', 'socket': 'a socket', '': 'a folder'}
    for name, what in wrong.items():
        with pytest.raises(OSError, match=f'it is {what} and no file'):
            regular(tmp_path / name)
    with pytest.raises(OSError, match='it is a device and no file'):
        regular('/dev/zero')
    with pytest.raises(FileNotFoundError):
        regular(tmp_path / 'nothing')


def test_a_plain_file_is_read_as_ever(tmp_path: Path) -> None:
    path = tmp_path / 'a.yaml'
    path.write_text('a: {b: [1, 2.5, yes]}\n')
    assert read_yaml(path, ConfigError) == {'a': {'b': [1, 2.5, True]}}
    path.write_text('# nothing\n')
    assert read_yaml(path, ConfigError) is None


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('[' * 100_000, 'recursion'),
        ('a: &a [*a]', r'aliases \(\*name\) cannot be used'),
        ('/**: &a\n  ros__parameters: *a', 'aliases'),
        ('a: b: c', 'mapping values are not allowed here'),
        ('a: ' + '9' * 5000, 'integer string conversion'),
        ('a: 2001-99-99', 'month must be in 1..12'),
        ('a: !!python/object:os.system x', 'could not determine a constructor'),
        ('\x00', 'special characters are not allowed'),
    ],
)
def test_whatever_is_wrong_is_one_line(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / 'a.yaml'
    path.write_text(text)
    with pytest.raises(ConfigError, match=reason) as caught:
        read_yaml(path, ConfigError)
    assert str(caught.value).startswith(f'{path} is not YAML that can be used: ')
    assert '\n' not in str(caught.value)


def test_what_is_no_text_or_no_file_is_said(tmp_path: Path) -> None:
    (tmp_path / 'a.yaml').write_bytes(b'\xff\xfe\x00')
    with pytest.raises(ConfigError, match='codec'):
        read_yaml(tmp_path / 'a.yaml', ConfigError)
    with pytest.raises(ConfigError, match='cannot be read: it is a folder and no file'):
        read_yaml(tmp_path, ConfigError)
