# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.files.reading import read_yaml


def test_yaml_is_read(tmp_path: Path) -> None:
    path = tmp_path / 'a.yaml'
    path.write_text('a: {b: [1, 2.5, yes]}\n')
    assert read_yaml(path, ConfigError) == {'a': {'b': [1, 2.5, True]}}


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
