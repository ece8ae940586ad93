# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_tools.gait_model.sheet import contact_sheet


@pytest.fixture
def bank():
    templates = np.zeros((3, 4, 40, 32), dtype=np.uint8)
    for sequence in range(3):
        for phase in range(4):
            templates[sequence, phase] = 10 * sequence + phase + 1
    return TemplateBank(templates, np.zeros(3, np.float32), ('a', 'b', 'c'), 0.9)


def test_rows_are_sequences_and_columns_phases(bank):
    sheet = contact_sheet(bank, columns=2, sequences=[2, 0])
    tiles = sheet[-80:, -64:]
    assert (tiles[:40, :32] == 21).all()
    assert (tiles[:40, 32:] == 23).all()
    assert (tiles[40:, :32] == 1).all()
    assert sheet[:, :-64].any()  # labels


def test_all_sequences_and_at_most_all_phases(bank):
    assert contact_sheet(bank, columns=100).shape == contact_sheet(bank, columns=4).shape


def test_bad_input(bank):
    with pytest.raises(BankError, match=r'sequences must be from 0 to 2, got \[3\]'):
        contact_sheet(bank, sequences=[0, 3])
    with pytest.raises(BankError, match='columns must be at least 1, got 0'):
        contact_sheet(bank, columns=0)
