# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from random import Random

import pytest

from gait_segmentation.streams.join import ExactJoin

S = 1_000_000_000
STAGES = {'camera': 'a', 'tracker': 'b', 'matcher': 'cd'}


def empty(parts: str, capacity: int = 8) -> ExactJoin:
    """Return a join of some of the parts a (camera), b (tracker), c and d (matcher)."""
    stages = {stage: [each for each in own if each in parts] for stage, own in STAGES.items()}
    return ExactJoin({stage: own for stage, own in stages.items() if own}, capacity)


def counts(join: ExactJoin) -> tuple[dict[str, int], dict[str, int]]:
    return dict(join.missed), dict(join.skipped)


NOTHING: tuple[dict[str, int], dict[str, int]] = ({}, {})


@pytest.mark.parametrize('seed', range(20))
def test_what_is_on_the_way_when_stamps_jump_back_is_not_lost(seed: int) -> None:
    random = Random(seed)
    stamps = [*range(10, 30), *range(10, 30), *range(5, 15)]
    join = empty('abcd')
    taken = dict.fromkeys('abcd', 0)
    joined = []
    while min(taken.values()) < len(stamps):
        # In life, too, nobody is far behind the camera.
        part = random.choice(
            [p for p in 'abcd' if taken[p] < min(len(stamps), min(taken.values()) + 5)]
        )
        parts = join.add(part, stamps[taken[part]], taken[part])
        taken[part] += 1
        if parts:
            assert len(set(parts.values())) == 1
            joined.append(parts['a'])
    assert sorted(joined) == list(range(len(stamps)))
    assert (len(join), counts(join)) == (0, NOTHING)


def joined(parts: str, capacity: int = 8) -> ExactJoin:
    """Return a join that has been complete at stamp 10."""
    join = empty(parts, capacity)
    assert [join.add(part, 10, 'x') for part in parts][-1] is not None
    return join


def test_what_a_stage_says_nothing_of_it_has_skipped() -> None:
    join = joined('abcd')
    for stamp in (11, 12, 13):
        join.add('a', stamp, 'x')
    # The tracker skips 11, the matcher 12.
    join.add('b', 12, 'x')
    join.add('b', 13, 'x')
    join.add('c', 13, 'x')
    assert join.add('d', 13, 'x') is not None
    assert (len(join), counts(join)) == (0, ({}, {'tracker': 1, 'matcher': 1}))


def test_what_came_before_a_stage_was_there_is_no_loss() -> None:
    join = empty('ab')
    for stamp in range(1, 6):
        join.add('a', stamp, 'x')
    assert join.add('b', 5, 'x') is not None
    join.add('a', 6, 'x')
    assert join.add('b', 6, 'x') is not None
    assert (len(join), counts(join)) == (0, NOTHING)


def test_an_entry_is_counted_once_however_late_its_parts_come() -> None:
    join = joined('acd')
    join.add('c', 11, 'x')
    for part in 'acd':
        join.add(part, 12, 'x')
    assert (len(join), counts(join)) == (0, ({'a': 1}, {}))
    assert join.add('d', 11, 'x') is None
    assert (len(join), counts(join)) == (0, ({'a': 1}, {}))


def test_what_there_is_no_room_for_is_ignored_and_counted_once_its_publisher_is_there() -> None:
    join = empty('ab', 2)
    for stamp in range(1, 6):
        join.add('a', stamp, 'x')
    assert (len(join), counts(join)) == (2, NOTHING)
    # Perhaps nobody worked on the first ones.
    assert [join.add('b', stamp, 'x') is not None for stamp in range(1, 5)] == [False] * 3 + [True]
    assert counts(join) == NOTHING
    for stamp in range(6, 10):
        join.add('a', stamp, 'x')
    assert join.waits_for == 'tracker'
    assert [join.add('b', stamp, 'x') is not None for stamp in range(5, 10)] == [False] * 3 + [
        True
    ] * 2
    # But for the first of them, which began before.
    assert counts(join) == ({}, {'tracker': 2})


def test_one_who_lags_by_more_than_may_wait_is_told_of_though_nothing_is_ever_joined() -> None:
    join = empty('ab', 2)
    for stamp in range(1, 20):
        join.add('a', stamp, 'x')
        if stamp > 5:
            assert join.add('b', stamp - 5, 'x') is None
    assert counts(join)[1]['tracker'] > 5


def test_the_first_in_the_order_of_the_work_is_waited_for() -> None:
    join = joined('abcd', 2)
    assert join.waits_for == ''
    for stamp in range(11, 15):
        join.add('a', stamp, 'x')
        join.add('b', stamp, 'x')
    assert (join.waits_for, counts(join)) == ('matcher', ({}, {'matcher': 2}))


def test_a_part_that_comes_twice_is_ignored_and_counted() -> None:
    join = empty('ab')
    join.add('a', 1, 'first')
    assert join.add('a', 1, 'second') is None
    assert join.add('b', 1, 'b') == {'a': 'first', 'b': 'b'}
    assert join.stale == 1
