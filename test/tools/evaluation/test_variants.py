# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips that are made harder have the truth of the clips they are made of."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.variants import KINDS, LATE, MAPS, TIMES, Left, Variant

from .fakes import write_sequence

WALKER = Path(__file__).parents[3] / 'examples/walker'


@cache
def walker() -> Sequence:
    return Sequence.load(WALKER)


@pytest.mark.parametrize('kind', KINDS)
def test_a_harder_clip_has_the_same_truth(kind: str) -> None:
    made = Variant.of(walker(), kind)
    assert np.array_equal(made.truth(7), walker().truth(7))
    assert (made.numbers, made.starts) == (walker().numbers, walker().starts)
    for number, alike in ((7, ('plain', *LATE)), (walker().numbers[-1], ('plain',))):
        same = np.array_equal(made.image(number), walker().image(number))
        assert same == (kind in (*alike, *MAPS))
    if kind in MAPS:
        heat = made.heat_maps(TIMES.get(kind, 'map'))(6)
        assert heat.values.shape == (192, 256)
        assert heat.stamp_ns == made.stamp_ns(3 if kind == 'map-late' else 6)


def test_maps_show_where_somebody_is() -> None:
    values = {kind: Variant.of(walker(), kind).heat_map('', 0) for kind in MAPS}
    person = walker().truth(0) == 255
    assert values['map'][person].mean() > 150 > values['map'][~person].mean() + 50
    assert 0.02 < (values['map'][person] < 60).mean() < 0.2
    assert np.array_equal(values['map-inverted'], 255 - values['map'])
    assert np.array_equal(values['map-mirrored'], values['map'][:, ::-1])
    given = Variant.of(walker(), 'map-inverted', 'masks')
    assert np.array_equal(given.heat_map('', 0), 255 - walker().truth(0))


def test_whoever_left_is_not_in_the_picture(tmp_path: Path) -> None:
    whole = Sequence.load(write_sequence(tmp_path / 'a', frames=30, size=(90, 40)))
    assert Left.of(whole) is None, 'not known to stand'
    whole.about['camera'] = 'static'
    left = Left.of(whole)
    assert left is not None
    assert (left.since, left.numbers) == (15, list(range(15 + 62)))
    assert np.array_equal(left.image(14), whole.image(14))
    assert np.array_equal(left.truth(14), whole.truth(14))
    place = left.image(40)
    assert np.abs(place.astype(int) - 120).max() < 12
    assert not np.array_equal(place, left.image(41)), "a camera's noise"
    assert not left.truth(40).any()
    assert left.gone(list(range(77))) == list(range(27, 77))
    short = Sequence.load(write_sequence(tmp_path / 'b', frames=29))
    short.about['camera'] = 'static'
    assert Left.of(short) is None
