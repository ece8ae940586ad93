# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import TemplateBank


def make(**changes):
    parts = {
        'templates': np.arange(2 * 3 * 4 * 5, dtype=np.uint8).reshape(2, 3, 4, 5),
        'azimuth': np.array([0.0, 1.5], dtype=np.float32),
        'builds': ('a', 'b'),
        'fill': 0.9,
        'provenance': {'source': 'test'},
    }
    return TemplateBank(**{**parts, **changes})


def test_sizes():
    bank = make()
    assert (bank.sequences, bank.phases, bank.grid) == (2, 3, (4, 5))


def test_save_and_load(tmp_path):
    bank = make()
    path = tmp_path / 'bank.npz'
    bank.save(path)
    again = TemplateBank.load(str(path))
    assert (again.templates == bank.templates).all()
    assert (again.azimuth == bank.azimuth).all()
    assert again.builds == bank.builds
    assert again.fill == bank.fill
    assert again.provenance == bank.provenance
    assert again.templates.dtype == np.uint8
    assert again.azimuth.dtype == np.float32
    assert [file.name for file in tmp_path.iterdir()] == ['bank.npz']


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'templates': np.zeros((2, 3, 4), np.uint8)}, r'must be \(sequences, .*got \(2, 3, 4\)'),
        ({'templates': np.zeros((2, 3, 4, 5))}, 'uint8, got .*float64'),
        ({'templates': np.zeros((2, 0, 4, 5), np.uint8)}, 'must not be empty'),
        ({'azimuth': np.zeros(3, np.float32)}, '2 sequences need as many azimuths'),
        ({'azimuth': np.zeros(2)}, 'finite float32, got float64'),
        ({'azimuth': np.array([0, np.nan], np.float32)}, 'finite float32'),
        ({'builds': ('a',)}, '2 sequences need'),
        ({'fill': 0.0}, r'fill must be in \(0, 1\], got 0.0'),
    ],
)
def test_malformed_banks_are_refused(changes, message):
    with pytest.raises(BankError, match=message):
        make(**changes)


def test_a_file_whose_parts_do_not_fit_is_refused_by_name(tmp_path):
    bank = make()
    path = tmp_path / 'odd.npz'
    object.__setattr__(bank, 'fill', 3.0)
    bank.save(path)
    with pytest.raises(BankError, match=r'odd\.npz: fill must be in'):
        TemplateBank.load(path)
