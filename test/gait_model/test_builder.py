# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.errors import BankError, ConfigError
from gait_segmentation.gait_model import TemplateBank, builder, open_bank
from gait_segmentation.gait_model.body import named_build
from gait_segmentation.gait_model.builder import BankSpec, build_bank, model_digest, quantize

SMALL = BankSpec(height=48, width=32, azimuths=4, phases=6, builds='average, stout')


def test_bank_has_what_the_specification_says():
    done = []
    bank = build_bank(SMALL, lambda: done.append(1))
    assert bank.templates.shape == (8, 6, 48, 32)
    assert bank.builds == ('average',) * 4 + ('stout',) * 4
    assert bank.azimuth[:4] == pytest.approx([0, np.pi / 2, np.pi, -np.pi / 2])
    assert len(np.unique(bank.templates)) <= 8
    assert bank.templates.min() == 0
    assert bank.templates.max() == 255
    assert len(done) == 8
    assert json.loads(bank.provenance['spec'])['phases'] == 6
    assert model_digest() in bank.provenance['model']


def test_the_same_bank_twice():
    assert (build_bank(SMALL).templates == build_bank(SMALL).templates).all()


def test_two_azimuths_are_both_side_views():
    assert BankSpec(azimuths=2).azimuth_values == pytest.approx((0.0, np.pi))


def test_neighbouring_phases_are_more_alike_than_far_ones():
    bank = build_bank(BankSpec(height=48, width=32, azimuths=1, phases=20))
    soft = bank.templates[0].astype(int)

    def alike(lag):
        other = np.roll(soft, lag, axis=0)
        return np.minimum(soft, other).sum() / np.maximum(soft, other).sum()

    assert alike(1) > 0.7 > alike(5)


@given(st.integers(2, 256))
def test_quantize(levels):
    values = np.arange(256, dtype=np.uint8)
    once = quantize(values, levels)
    assert (quantize(once, levels) == once).all()
    assert len(np.unique(once)) == levels
    assert once[0] == 0
    assert once[255] == 255
    assert (np.diff(once.astype(int)) >= 0).all()
    assert np.abs(once.astype(int) - values).max() <= 255 / (levels - 1) / 2 + 1


def test_bad_specifications():
    with pytest.raises(ConfigError, match='phases must be an integer from 4 to 240, got 1'):
        BankSpec(phases=1)
    with pytest.raises(BankError, match=r"build must be one of.*got 'none'"):
        build_bank(BankSpec(builds='average,none'))


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

    monkeypatch.setattr(builder, 'build_bank', counted)
    return calls


def test_drawn_once_and_then_read(folder, drawn):
    first, second = builder.cached_bank(SPEC), builder.cached_bank(SPEC)
    assert drawn == [SPEC]
    assert (first.templates == second.templates).all()
    assert first.provenance == second.provenance
    assert len(list(folder.iterdir())) == 1


def test_a_file_is_read_once_until_it_changes(folder, drawn):
    builder.cached_bank(SPEC)
    second = builder.cached_bank(SPEC)
    assert builder.cached_bank(SPEC) is second
    path = next(folder.iterdir())
    changed = TemplateBank(255 - second.templates, second.azimuth, second.builds, second.fill)
    changed.save(path)
    assert (builder.cached_bank(SPEC).templates == changed.templates).all()
    assert drawn == [SPEC]


def test_another_specification_or_model_is_another_file(folder, drawn, monkeypatch):
    builder.cached_bank(SPEC)
    builder.cached_bank(dataclasses.replace(SPEC, fill=0.88))
    monkeypatch.setattr(builder, 'model_digest', lambda: 'another model')
    builder.cached_bank(SPEC)
    assert len(drawn) == 3
    assert len(list(folder.iterdir())) == 3


def test_a_damaged_file_is_replaced(folder, drawn):
    builder.cached_bank(SPEC)
    file = next(folder.iterdir())
    file.write_bytes(file.read_bytes()[:100])
    builder.cached_bank(SPEC)
    builder.cached_bank(SPEC)
    assert len(drawn) == 2


def test_a_cache_that_cannot_be_written_only_costs_the_drawing(tmp_path, drawn, monkeypatch):
    blocked = tmp_path / 'file'
    blocked.write_text('not a folder')
    monkeypatch.setenv('XDG_CACHE_HOME', str(blocked))
    assert builder.cached_bank(SPEC).sequences == 2
    assert builder.cached_bank(SPEC).sequences == 2
    assert len(drawn) == 2


def test_without_a_folder_in_the_environment_it_is_below_home(monkeypatch):
    for value in (None, '', 'relative/path'):
        if value is None:
            monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
        else:
            monkeypatch.setenv('XDG_CACHE_HOME', value)
        monkeypatch.setenv('HOME', '/home/somebody')
        assert builder.cache_folder() == Path('/home/somebody/.cache/gait_segmentation')


def test_errors_of_the_specification_are_not_hidden(folder):
    with pytest.raises(BankError, match='build must be one of'):
        builder.cached_bank(BankSpec(builds='nobody'))


def test_the_standard_bank_has_480_templates(monkeypatch):
    monkeypatch.setattr(builder, 'cached_bank', lambda spec: spec)
    spec = builder.default_bank()
    views, builds = set(spec.azimuth_values), {named_build(name) for name in spec.build_names}
    assert (len(views), spec.phases, len(builds)) == (16, 30, 1)


def test_a_bank_file_is_opened(tmp_path: Path) -> None:
    build_bank(SPEC).save(tmp_path / 'bank.npz')
    assert open_bank(str(tmp_path / 'bank.npz')).templates.shape[-2:] == (48, 32)
    with pytest.raises(BankError):
        open_bank(str(tmp_path / 'missing.npz'))
