# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.files.installed import prepare, shared_file

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
    environment = {'FASTDDS_DEFAULT_PROFILES_FILE': '/mine.xml', 'MALLOC_ARENA_MAX': '2'}
    prepare(environment)
    assert environment['MALLOC_ARENA_MAX'] == '2'
    assert environment['FASTDDS_DEFAULT_PROFILES_FILE'] == '/mine.xml'
    assert 'FASTRTPS_DEFAULT_PROFILES_FILE' not in environment
    environment = {}
    prepare(environment)
    assert environment['FASTDDS_DEFAULT_PROFILES_FILE'].endswith(PROFILE)
    assert 'MALLOC_TRIM_THRESHOLD_' in environment
