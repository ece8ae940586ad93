# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.finding.heads import _DEEP, _gap, columns_of_people


def people(*middles: int, size: tuple[int, int] = (100, 120)) -> np.ndarray:
    """Return (h, w) bool of people 100 pixels tall who stand about the given columns."""
    out = np.zeros(size, bool)
    for middle in middles:
        out[:20, middle - 7 : middle + 7] = True
        out[20:, middle - 18 : middle + 18] = True
    columns = np.flatnonzero(out.any(axis=0))
    return out[:, columns[0] : columns[-1] + 1]


def test_those_who_touch_are_cut_between_their_heads() -> None:
    (first, cut), (second, last) = columns_of_people(people(20, 54))
    assert (first, second, last) == (0, cut, 70)
    assert cut == pytest.approx(35, abs=2)
    assert len(columns_of_people(people(18, 60, 100))) == 3


def test_those_of_whom_a_gap_shows_down_to_the_ground_are_cut_there() -> None:
    bounds = columns_of_people(people(20, 80))
    assert len(bounds) == 2
    assert 36 <= bounds[0][1] <= 60


def test_one_head_is_one_person() -> None:
    # In the second picture the head shows twice, as it does when two frames are compared.
    for part in (people(20), people(40, 52), np.ones((60, 60), bool)):
        assert columns_of_people(part) == [(0, part.shape[1])]


def test_what_is_lower_than_a_head_is_none() -> None:
    lower = people(20, 60)
    lower[:30, 40:] = False
    assert len(columns_of_people(lower)) == 1


def test_of_the_small_nothing_is_said() -> None:
    small = people(20, 60)[::4, ::4]
    assert columns_of_people(small) == [(0, small.shape[1])]


def test_a_gap_lies_deep_below_the_lower_of_two_heads() -> None:
    for deep, found in ((1.2, True), (0.8, False)):
        top = np.full(60, 10 + deep * _DEEP * 100, int)
        top[10:20], top[40:50] = 0, 10
        for one, two in ((15, 45), (45, 15)):
            gap = _gap(top, one, two, 100)
            assert (gap is not None) == found
            if gap is not None:
                assert 29 <= gap <= 31
