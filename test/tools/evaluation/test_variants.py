# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips that are made harder have the truth of the clips they are made of."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.variants import CAMERAS, KINDS, LATE, write_variant

WALKER = Path(__file__).parents[3] / 'examples/walker'


@cache
def walker() -> Sequence:
    return Sequence.load(WALKER)


@pytest.mark.parametrize('kind', KINDS)
def test_a_harder_clip_has_the_same_truth(kind: str, tmp_path: Path) -> None:
    maps = write_variant(walker(), kind, tmp_path / 'made')
    made = Sequence.load(tmp_path / 'made')
    assert (made.numbers, made.starts, made.fps) == (
        walker().numbers,
        walker().starts,
        walker().fps,
    )
    assert np.array_equal(made.truth(7), walker().truth(7))
    assert bool(maps) == (kind not in CAMERAS)
    for number, alike in ((7, ('plain', *LATE)), (walker().numbers[-1], ('plain',))):
        same = np.array_equal(made.image(number), walker().image(number))
        assert same == (kind in alike or bool(maps))
    if maps:
        heat = made.heat_maps(maps)(6)
        assert heat.values.shape == (192, 256)
        assert heat.stamp_ns == made.stamp_ns(3 if kind == 'map-late' else 6)


def test_maps_show_where_somebody_is(tmp_path: Path) -> None:
    values = {}
    for kind in ('map', 'map-inverted', 'map-mirrored'):
        maps = write_variant(walker(), kind, tmp_path / kind)
        values[kind] = Sequence.load(tmp_path / kind).heat_maps(maps)(0).values
    person = walker().truth(0) == 255
    assert values['map'][person].mean() > 150 > values['map'][~person].mean() + 50
    assert 0.02 < (values['map'][person] < 60).mean() < 0.2
    assert np.array_equal(values['map-inverted'], 255 - values['map'])
    assert np.array_equal(values['map-mirrored'], values['map'][:, ::-1])
