# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.gait_model.bank import quantize
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.results import MatchResult
from gait_tools.figures.pictures import TILE, chosen, draw_frames, table_of
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
    steps = (np.diff(np.sort(templates, axis=0).astype(int), axis=0) > 0).sum(axis=0)
    clear = (table.likelihood >= 30) & (table.likelihood <= 225)
    assert steps[table.row, table.column] == steps[clear].max()
    for value in range(256):
        assert table.split[value] == (here <= value).sum()


def test_frames_are_spread_and_those_without_a_match_left_out():
    shots = list(short())
    assert [shot.given.number for shot in chosen(shots, 3)] in ([0, 4, 7], [0, 3, 7])
    nobody = MatchResult.nobody(1, 0, (10, 10))
    shots[0] = replace(shots[0], match=nobody)
    assert chosen(shots, 2)[0].given.number == 1
    assert len(chosen(shots, 99)) == 7


def test_four_pictures_of_each_frame_are_drawn():
    shots = chosen(short(), 3)
    sheet = draw_frames(shots, 12)
    width, height = TILE
    assert sheet.shape == (4 * (height + 4) + 4, 3 * (width + 4) + 4, 3)
    first = sheet[4 : 4 + height, 4 : 4 + width].astype(int)
    blue, green, red = np.moveaxis(first, 2, 0)
    assert ((red > 180) & (green < 100) & (blue < 100)).sum() > 100
    assert ((green > 180) & (red < 110) & (blue < 110)).sum() > 100
    mask = sheet[-height - 4 : -4, 4 : 4 + width]
    assert (mask == 255).all(axis=2).mean() > 0.4
    bare = [replace(each, given=each.given._replace(truth=None)) for each in shots]
    assert draw_frames(bare, 12).shape == sheet.shape
