# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.storage import (
    FORMAT,
    FORMAT_VERSION,
    read_bank,
    write_bank,
)


def entries():
    return {
        'templates': np.zeros((1, 2, 3, 4), dtype=np.uint8),
        'azimuth': np.zeros(1, dtype=np.float32),
        'builds': ('average',),
        'fill': 0.9,
        'provenance': {'source': 'test'},
    }


def write_raw(path, **changes):
    arrays = {
        'format': np.array(FORMAT),
        'version': np.array(FORMAT_VERSION),
        'templates': np.zeros((1, 2, 3, 4), dtype=np.uint8),
        'azimuth': np.zeros(1, dtype=np.float32),
        'builds': np.array(['average']),
        'fill': np.array(0.9),
        'provenance': np.array('{"source": "test"}'),
    }
    arrays.update(changes)
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})


def test_round_trip(tmp_path):
    path = tmp_path / 'bank.npz'
    write_bank(path, entries())
    found = read_bank(path)
    assert found['builds'] == ('average',)
    assert found['provenance'] == {'source': 'test'}
    assert found['fill'] == 0.9


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'version': np.array(99)}, 'is a bank of version 99, this program reads version 1'),
        ({'version': np.array('1')}, 'version.*must be a single number'),
        ({'format': np.array('something')}, "format must be .*got 'something'"),
        ({'format': None}, 'entries format and version expected'),
        ({'templates': None, 'fill': None}, 'entries missing: templates, fill'),
        ({'builds': np.array([1, 2])}, 'builds must be a list of texts, got int64'),
        (
            {'fill': np.array([0.9])},
            r"'fill' must be a single number, got float64 of shape \(1,\)",
        ),
        ({'provenance': np.array('{')}, 'provenance must be JSON'),
        ({'provenance': np.array('[1]')}, 'provenance must be a JSON object of texts'),
        ({'builds': np.array([{}], dtype=object)}, 'is not a bank or is damaged.*pickle'),
    ],
)
def test_wrong_files_are_named(tmp_path, changes, message):
    path = tmp_path / 'wrong.npz'
    write_raw(path, **changes)
    with pytest.raises(BankError, match=message) as caught:
        read_bank(path)
    assert str(path) in str(caught.value)


def test_missing_folder_and_other_files(tmp_path):
    with pytest.raises(BankError, match=r'cannot read the bank .*No such file'):
        read_bank(tmp_path / 'none.npz')
    with pytest.raises(BankError, match='cannot read the bank'):
        read_bank(tmp_path)
    text = tmp_path / 'text.npz'
    text.write_text('hello')
    with pytest.raises(BankError, match=r'is not a bank: expected an \.npz'):
        read_bank(text)
    empty = tmp_path / 'empty.npz'
    empty.write_bytes(b'')
    with pytest.raises(BankError, match=r'is not a bank: expected an \.npz'):
        read_bank(empty)
    plain = tmp_path / 'plain.npz'
    with plain.open('wb') as file:
        np.save(file, np.zeros(3))
    with pytest.raises(BankError, match=r'expected an .npz archive'):
        read_bank(plain)


def test_truncated_and_damaged_files_never_pass_nor_crash(tmp_path):
    path = tmp_path / 'bank.npz'
    parts = entries()
    noise = np.random.default_rng(0).integers(0, 256, (1, 4, 32, 32), dtype=np.uint8)
    write_bank(path, {**parts, 'templates': noise})
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.9, 0.99):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(BankError):
            read_bank(path)
    for at in range(0, len(whole), max(len(whole) // 150, 1)):
        broken = bytearray(whole)
        broken[at] ^= 0xFF
        path.write_bytes(bytes(broken))
        try:
            found = read_bank(path)
        except BankError:
            continue
        # A flipped bit outside of the data, such as a time stamp, does no harm.
        assert (found['templates'] == noise).all()


def test_a_failed_write_leaves_the_old_file_and_no_rubbish(tmp_path, monkeypatch):
    path = tmp_path / 'bank.npz'
    write_bank(path, entries())
    before = path.read_bytes()

    def fail(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'replace', fail)
    with pytest.raises(BankError, match=r'cannot write the bank .*: No space left on device'):
        write_bank(path, entries())
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ['bank.npz']


def test_a_missing_folder_cannot_be_written_to(tmp_path):
    with pytest.raises(BankError, match='cannot write the bank'):
        write_bank(tmp_path / 'none' / 'bank.npz', entries())


def test_a_pipe_is_no_bank(tmp_path):
    os.mkfifo(tmp_path / 'bank.npz')
    with pytest.raises(BankError, match=r'cannot read the bank .*: it is a pipe and no file'):
        read_bank(tmp_path / 'bank.npz')
