# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from gait_segmentation.errors import ConfigError
from gait_segmentation.ros.join import ExactJoin


def test_parts_of_one_stamp_are_joined_in_any_order() -> None:
    join = ExactJoin(('a', 'b'), 4)
    assert join.add('a', 1, 'a1') is None
    assert join.add('b', 1, 'b1') == {'a': 'a1', 'b': 'b1'}
    assert join.add('b', 2, 'b2') is None
    assert join.add('a', 2, 'a2') == {'a': 'a2', 'b': 'b2'}
    assert len(join) == 0


@given(st.permutations([(part, stamp) for part in 'abc' for stamp in range(1, 6)]))
def test_every_stamp_is_joined_once_if_no_topic_goes_back(order) -> None:
    join = ExactJoin('abc', 5)
    stamps = {part: iter(range(1, 6)) for part in 'abc'}
    joined = []
    for part, _ in order:
        stamp = next(stamps[part])
        parts = join.add(part, stamp, stamp)
        if parts:
            assert set(parts.values()) == {stamp}
            joined.append(stamp)
    assert sorted(joined) == [1, 2, 3, 4, 5]


def test_the_oldest_arrival_goes_first_whatever_its_stamp() -> None:
    join = ExactJoin(('a', 'b'), 2)
    join.add('a', 900, 'old')
    join.add('b', 1, 'new')
    join.add('b', 2, 'new')
    assert join.add('b', 900, 'late') is None


def test_a_topic_that_jumps_back_drops_what_it_was_in() -> None:
    join = ExactJoin(('a', 'b'), 8)
    join.add('a', 100, 'old')
    join.add('a', 50, 'new')
    assert join.add('b', 100, 'old') is None
    assert join.add('b', 50, 'new') == {'a': 'new', 'b': 'new'}


def test_a_topic_that_jumps_later_meets_the_one_that_jumped_first() -> None:
    join = ExactJoin(('a', 'b'), 8)
    join.add('a', 100, 'old')
    join.add('b', 100, 'old')
    join.add('a', 1, 'new')
    join.add('a', 2, 'new')
    assert join.add('b', 1, 'new') is not None
    assert join.add('b', 2, 'new') is not None


def test_clear_forgets() -> None:
    join = ExactJoin(('a', 'b'), 8)
    join.add('a', 5, 'x')
    join.clear()
    assert len(join) == 0
    assert join.add('b', 5, 'y') is None


def test_what_makes_no_sense_is_refused() -> None:
    with pytest.raises(ConfigError, match='capacity of at least 1'):
        ExactJoin(('a',), 0)
    with pytest.raises(ConfigError, match='needs parts'):
        ExactJoin((), 3)
    with pytest.raises(KeyError, match="one of a, got 'b'"):
        ExactJoin(('a',), 3).add('b', 1, None)
