# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.gait_model.bank import quantize
from gait_segmentation.matching import MatchingConfig
from gait_tools.figures.access_table import draw_access_table, table_of
from test.walkers import small_bank

from .shots import short


@pytest.mark.parametrize('levels', [8, 256])
def test_the_table_adds_what_comparing_would(levels):
    shot, bank = short()[4], small_bank()
    table = table_of(shot, bank, MatchingConfig(levels=levels))
    templates = quantize(bank.templates[shot.match.sequence], levels)
    here = templates[:, table.row, table.column]
    assert (table.values == here[table.order]).all()
    assert (np.diff(table.values.astype(int)) >= 0).all()
    assert (table.added() == np.minimum(table.values, table.value)).all()
    for value in range(256):
        assert table.split[value] == (here <= value).sum()


def test_the_likelihood_is_that_on_the_templates_grid():
    shot, bank = short()[4], small_bank()
    table = table_of(shot, bank, MatchingConfig())
    template = bank.templates[shot.match.sequence, shot.match.phase_index]
    assert table.likelihood.shape == template.shape
    inside = table.likelihood[template > 200]
    assert inside.mean() > 200
    assert table.likelihood[template == 0].mean() < 60


def test_the_table_is_drawn():
    table = table_of(short()[4], small_bank(), MatchingConfig())
    picture = draw_access_table(table, 4, 0.0)
    assert picture.ndim == 3
    assert (picture != 255).any(axis=2).mean() > 0.2
