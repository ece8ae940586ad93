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


def joined(*parts: str) -> ExactJoin:
    """Return a join that has been complete at stamp 10."""
    join = ExactJoin(parts, 8)
    assert [join.add(part, 10, 'x') for part in parts][-1] is not None
    return join


def test_what_a_part_has_passed_by_is_dropped_and_counted() -> None:
    join = joined('a', 'b', 'c')
    for stamp in (11, 12, 13):
        join.add('a', stamp, 'x')
    join.add('b', 12, 'x')
    assert len(join) == 2
    assert join.missed == {'b': 1}
    assert join.add('c', 12, 'x') is not None
    join.add('c', 13, 'x')
    assert join.add('b', 13, 'x') is not None
    assert (len(join), join.missed) == (0, {'b': 1})


def test_an_entry_is_counted_once_however_late_its_parts_come() -> None:
    join = joined('a', 'b', 'c')
    join.add('a', 12, 'x')
    join.add('b', 11, 'x')
    join.add('c', 11, 'x')
    assert (len(join), join.missed) == (1, {'a': 1})
    # Of the bag's next run it may be complete.
    for part in 'abc':
        join.add(part, 9, 'new')
    assert [join.add(part, 11, 'new') for part in 'abc'][-1] == dict.fromkeys('abc', 'new')
    assert join.missed == {'a': 1}


def test_nothing_is_given_up_before_all_parts_have_come() -> None:
    join = ExactJoin(('a', 'b'), 8)
    join.add('a', 2, 'x')
    join.add('b', 1, 'x')
    join.add('b', 3, 'x')
    assert (len(join), join.missed) == (3, {})


def test_what_has_jumped_back_waits_for_a_part_that_has_not_yet() -> None:
    join = joined('a', 'b')
    join.add('a', 100, 'old')
    join.add('a', 1, 'new')
    join.add('b', 100, 'old')
    assert join.add('b', 1, 'new') == {'a': 'new', 'b': 'new'}
    assert not join.missed


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
