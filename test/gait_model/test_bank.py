# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import os

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import (
    BANK_FORMAT,
    BANK_VERSION,
    TemplateBank,
    default_bank,
    fine_grid,
    quantize,
)


def make(**changes):
    parts = {
        'templates': np.arange(2 * 3 * 4 * 5, dtype=np.uint8).reshape(2, 3, 4, 5),
        'azimuth': np.array([0.0, 1.5], dtype=np.float32),
        'builds': ('a', 'b'),
        'fill': 0.9,
        'provenance': {'source': 'test'},
    }
    return TemplateBank(**{**parts, **changes})


def finer(**changes):
    parts = {
        'templates': np.ones((3, 3, 48, 60), np.uint8),
        'azimuth': np.zeros(3, np.float32),
        'builds': ('b', 'a', 'a'),
        'fill': 0.9,
    }
    return TemplateBank(**{**parts, **changes})


@pytest.mark.parametrize('fine', [None, finer()])
def test_save_and_load(tmp_path, fine):
    bank = make(finer=fine)
    path = tmp_path / 'bank.npz'
    bank.save(path)
    again = TemplateBank.load(str(path))
    assert (again.templates == bank.templates).all()
    assert (again.azimuth == bank.azimuth).all()
    assert again.builds == bank.builds
    assert again.fill == bank.fill
    assert again.provenance == bank.provenance
    assert (again.finer is None) == (fine is None)
    if fine is not None:
        assert (again.finer.templates == fine.templates).all()
        assert (again.finer.azimuth == fine.azimuth).all()
        assert (again.finer.builds, again.finer.fill) == (fine.builds, fine.fill)
    assert again.templates.dtype == np.uint8
    assert again.azimuth.dtype == np.float32
    assert [file.name for file in tmp_path.iterdir()] == ['bank.npz']


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'templates': np.zeros((2, 3, 4), np.uint8)}, r'must be \(sequences, .*got \(2, 3, 4\)'),
        ({'templates': np.zeros((2, 3, 4, 5))}, 'uint8, got .*float64'),
        ({'templates': np.zeros((2, 0, 4, 5), np.uint8)}, 'must not be empty'),
        ({'templates': np.zeros((1, 1, 3000, 3000), np.uint8)}, 'at most 8421504 pixels'),
        ({'azimuth': np.zeros(3, np.float32)}, '2 sequences need as many azimuths'),
        ({'azimuth': np.zeros(2)}, 'finite float32, got float64'),
        ({'builds': ('a',)}, '2 sequences need'),
        ({'fill': 0.0}, r'fill must be in \(0, 1\], got 0.0'),
        (
            {'finer': finer(templates=np.ones((3, 3, 48, 32), np.uint8))},
            r'finer views must have phases, grid and builds .*\(48, 60\).*, got .*\(48, 32\)',
        ),
        ({'finer': finer(builds=('a', 'a', 'a'))}, r"got .*\['a'\]"),
    ],
)
def test_malformed_banks_are_refused(changes, message):
    with pytest.raises(BankError, match=message):
        make(**changes)


def write_raw(path, **changes):
    arrays = {
        'format': np.array(BANK_FORMAT),
        'version': np.array(BANK_VERSION),
        'templates': np.zeros((1, 2, 3, 4), dtype=np.uint8),
        'azimuth': np.zeros(1, dtype=np.float32),
        'builds': np.array(['average']),
        'fill': np.array(0.9),
        'provenance': np.array('{"source": "test"}'),
    }
    arrays.update(changes)
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        (
            {'version': np.array(99)},
            'wrong.npz: a bank of version 99, this program reads version 2',
        ),
        ({'version': np.array('1')}, 'version.*must be a single number'),
        ({'format': np.array('something')}, "format must be .*got 'something'"),
        ({'format': None}, 'entries format and version expected'),
        ({'templates': None, 'fill': None}, 'entries missing: templates, fill'),
        ({'builds': np.array([1, 2])}, "'builds' must be texts, got int64"),
        (
            {'fill': np.array([0.9])},
            r"'fill' must be a single number, got float64 of shape \(1,\)",
        ),
        ({'provenance': np.array('{')}, 'provenance must be JSON'),
        ({'finer_azimuth': np.zeros(1, np.float32)}, 'missing: finer_templates, finer_builds'),
        ({'fill': np.array(3.0)}, 'wrong.npz: fill must be in'),
        ({'builds': np.array([{}], dtype=object)}, 'is not a bank or is damaged.*pickle'),
    ],
)
def test_wrong_files_are_named(tmp_path, changes, message):
    path = tmp_path / 'wrong.npz'
    write_raw(path, **changes)
    with pytest.raises(BankError, match=message) as caught:
        TemplateBank.load(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize('content', [b'', b'hello', b'\x93NUMPY'])
def test_missing_folder_and_other_files(tmp_path, content):
    with pytest.raises(BankError, match=r'cannot read the bank \S+none\.npz: No such file'):
        TemplateBank.load(tmp_path / 'none.npz')
    with pytest.raises(BankError, match='cannot read the bank'):
        TemplateBank.load(tmp_path)
    (tmp_path / 'other.npz').write_bytes(content)
    with pytest.raises(BankError, match=r'is not a bank: expected an \.npz'):
        TemplateBank.load(tmp_path / 'other.npz')


def test_truncated_and_damaged_files_never_pass_nor_crash(tmp_path):
    path = tmp_path / 'bank.npz'
    noise = np.random.default_rng(0).integers(0, 256, (2, 2, 32, 32), dtype=np.uint8)
    make(templates=noise).save(path)
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.9, 0.99):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(BankError):
            TemplateBank.load(path)
    for at in range(0, len(whole), max(len(whole) // 150, 1)):
        broken = bytearray(whole)
        broken[at] ^= 0xFF
        path.write_bytes(bytes(broken))
        try:
            found = TemplateBank.load(path)
        except BankError:
            continue
        # A flipped bit outside of the data, such as a time stamp, does no harm.
        assert (found.templates == noise).all()


def test_a_failed_write_leaves_the_old_file_and_no_rubbish(tmp_path, monkeypatch):
    path = tmp_path / 'bank.npz'
    make().save(path)
    before = path.read_bytes()

    def fail(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'replace', fail)
    with pytest.raises(BankError, match=r'cannot write the bank .*: No space left on device'):
        make().save(path)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ['bank.npz']


def test_the_standard_bank_has_480_templates():
    bank = default_bank()
    assert (len(set(bank.azimuth.tolist())), bank.phases, set(bank.builds)) == (
        16,
        30,
        {'average'},
    )
    assert bank.finer.sequences == 64


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


def test_finer_views_have_the_proportions_of_the_templates() -> None:
    rows, columns = fine_grid((32, 20))
    assert columns / rows == pytest.approx(20 / 32)
    assert rows > 32
