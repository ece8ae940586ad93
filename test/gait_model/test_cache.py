# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model import TemplateBank, cache, open_bank
from gait_segmentation.gait_model.build import named_build
from gait_segmentation.gait_model.builder import BankSpec, build_bank

SPEC = BankSpec(height=48, width=32, azimuths=2, phases=4)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    return tmp_path / 'gait_segmentation'


@pytest.fixture
def drawn(monkeypatch):
    calls = []

    def counted(spec, progress=None):
        calls.append(spec)
        return build_bank(spec, progress)

    monkeypatch.setattr(cache, 'build_bank', counted)
    return calls


def test_drawn_once_and_then_read(folder, drawn):
    first, second = cache.cached_bank(SPEC), cache.cached_bank(SPEC)
    assert drawn == [SPEC]
    assert (first.templates == second.templates).all()
    assert first.provenance == second.provenance
    assert len(list(folder.iterdir())) == 1


def test_a_file_is_read_once_until_it_changes(folder, drawn):
    cache.cached_bank(SPEC)
    second = cache.cached_bank(SPEC)
    assert cache.cached_bank(SPEC) is second
    path = next(folder.iterdir())
    changed = TemplateBank(255 - second.templates, second.azimuth, second.builds, second.fill)
    changed.save(path)
    assert (cache.cached_bank(SPEC).templates == changed.templates).all()
    assert drawn == [SPEC]


def test_another_specification_or_model_is_another_file(folder, drawn, monkeypatch):
    cache.cached_bank(SPEC)
    cache.cached_bank(dataclasses.replace(SPEC, fill=0.88))
    monkeypatch.setattr(cache, 'model_digest', lambda: 'another model')
    cache.cached_bank(SPEC)
    assert len(drawn) == 3
    assert len(list(folder.iterdir())) == 3


def test_a_damaged_file_is_replaced(folder, drawn):
    cache.cached_bank(SPEC)
    file = next(folder.iterdir())
    file.write_bytes(file.read_bytes()[:100])
    cache.cached_bank(SPEC)
    cache.cached_bank(SPEC)
    assert len(drawn) == 2


def test_a_cache_that_cannot_be_written_only_costs_the_drawing(tmp_path, drawn, monkeypatch):
    blocked = tmp_path / 'file'
    blocked.write_text('not a folder')
    monkeypatch.setenv('XDG_CACHE_HOME', str(blocked))
    assert cache.cached_bank(SPEC).sequences == 2
    assert cache.cached_bank(SPEC).sequences == 2
    assert len(drawn) == 2


def test_without_a_folder_in_the_environment_it_is_below_home(monkeypatch):
    for value in (None, '', 'relative/path'):
        if value is None:
            monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
        else:
            monkeypatch.setenv('XDG_CACHE_HOME', value)
        monkeypatch.setenv('HOME', '/home/somebody')
        assert cache.cache_folder() == Path('/home/somebody/.cache/gait_segmentation')


def test_errors_of_the_specification_are_not_hidden(folder):
    with pytest.raises(BankError, match='build must be one of'):
        cache.cached_bank(BankSpec(builds='nobody'))


def test_the_standard_bank_has_1920_templates(monkeypatch):
    monkeypatch.setattr(cache, 'cached_bank', lambda spec: spec)
    spec = cache.default_bank()
    views, builds = set(spec.azimuth_values), {named_build(name) for name in spec.build_names}
    assert (len(views), spec.phases, len(builds)) == (16, 30, 4)


def test_a_bank_file_is_opened(tmp_path: Path) -> None:
    build_bank(SPEC).save(tmp_path / 'bank.npz')
    assert open_bank(str(tmp_path / 'bank.npz')).templates.shape[-2:] == (48, 32)
    with pytest.raises(BankError):
        open_bank(str(tmp_path / 'missing.npz'))
