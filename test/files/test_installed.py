# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.files.installed import prepare, shared_file

PROFILE = 'config/fastdds_shm.xml'


def test_an_ament_prefix_comes_first(tmp_path, monkeypatch) -> None:
    file = tmp_path / 'share/gait_segmentation' / PROFILE
    file.parent.mkdir(parents=True)
    file.touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path}')
    assert shared_file(PROFILE) == file


def test_without_an_installation_the_source_tree_is_used(monkeypatch) -> None:
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    assert shared_file(PROFILE).is_file()


def test_a_missing_file_is_an_error_that_lists_the_places() -> None:
    with pytest.raises(ConfigError, match=r'no\.such.*looked for'):
        shared_file('no.such')


def test_what_is_set_is_kept() -> None:
    environment = {'FASTDDS_DEFAULT_PROFILES_FILE': '/mine.xml', 'MALLOC_ARENA_MAX': '2'}
    prepare(environment)
    assert environment['MALLOC_ARENA_MAX'] == '2'
    profiles = {name: value for name, value in environment.items() if 'PROFILES' in name}
    assert profiles == {'FASTDDS_DEFAULT_PROFILES_FILE': '/mine.xml'}
    environment = {}
    prepare(environment)
    assert set(environment) == {
        'FASTRTPS_DEFAULT_PROFILES_FILE',
        'FASTDDS_DEFAULT_PROFILES_FILE',
        'MALLOC_ARENA_MAX',
        'MALLOC_MMAP_THRESHOLD_',
        'MALLOC_TRIM_THRESHOLD_',
    }


def test_the_profile_is_xml_with_a_segment_for_large_images() -> None:
    root = ElementTree.parse(shared_file(PROFILE)).getroot()
    sizes = [int(each.text) for each in root.iter() if each.tag.endswith('segment_size')]
    assert sizes == [16 * 1024 * 1024]
