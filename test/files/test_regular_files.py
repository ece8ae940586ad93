# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from gait_segmentation.files.regular_files import regular


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
