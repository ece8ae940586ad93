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


def test_a_topic_that_jumps_back_drops_what_it_was_not_in() -> None:
    join = joined('ab')
    for part in 'ab':
        join.add(part, 5 * S, 'old')
    join.add('a', 6 * S, 'old')
    join.add('a', 1, 'new')
    assert join.add('b', 1, 'new') == {'a': 'new', 'b': 'new'}
    assert (len(join), counts(join)) == (0, ({}, {'tracker': 1}))


def joined(parts: str, capacity: int = 8) -> ExactJoin:
    """Return a join that has been complete at stamp 10."""
    join = empty(parts, capacity)
    assert [join.add(part, 10, 'x') for part in parts][-1] is not None
    return join


def test_what_a_part_has_passed_by_is_dropped_and_counted() -> None:
    join = joined('acd')
    for stamp in (11, 12, 13):
        join.add('a', stamp, 'x')
    join.add('c', 11, 'x')
    join.add('d', 12, 'x')
    assert len(join) == 2
    assert counts(join) == ({'d': 1}, {})
    assert join.add('c', 12, 'x') is not None
    join.add('d', 13, 'x')
    assert join.add('c', 13, 'x') is not None
    assert (len(join), counts(join)) == (0, ({'d': 1}, {}))


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


def test_what_a_later_stage_speaks_of_was_not_skipped_by_an_earlier_one() -> None:
    join = joined('ac')
    join.add('c', 11, 'x')
    join.add('a', 12, 'x')
    assert counts(join) == ({'a': 1}, {})


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
    join.add('a', 12 * S, 'x')
    join.add('c', 11 * S, 'x')
    join.add('d', 11 * S, 'x')
    assert (len(join), counts(join)) == (1, ({'a': 1}, {}))
    # Of the bag's next run it may be complete.
    for part in 'acd':
        join.add(part, 9 * S, 'new')
    assert [join.add(part, 11 * S, 'new') for part in 'acd'][-1] == dict.fromkeys('acd', 'new')
    assert join.missed == {'a': 1}


def test_nothing_is_given_up_before_all_parts_have_come() -> None:
    join = empty('ab')
    join.add('a', 2, 'x')
    join.add('b', 1, 'x')
    join.add('b', 3, 'x')
    assert (len(join), counts(join)) == (3, NOTHING)


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
    assert counts(join) == ({}, {'tracker': 3})


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


def test_who_comes_after_the_others_jumped_passes_by_what_they_have_seen_since() -> None:
    join = empty('ab')
    for stamp in (5, 1, 2, 3, 4):
        join.add('a', stamp * S, 'x')
    assert join.add('b', 1 * S, 'x') is not None
    assert join.add('b', 3 * S, 'x') is not None
    assert counts(join) == ({}, {'tracker': 1})


def test_of_two_with_one_stamp_the_newer_is_meant() -> None:
    join = empty('ab')
    for stamp, value in ((7 * S, 'old'), (5 * S, 'x'), (7 * S, 'new')):
        join.add('a', stamp, value)
    assert join.add('b', 7 * S, 'b') == {'a': 'new', 'b': 'b'}


def test_a_part_that_comes_twice_counts_once_and_the_first_time() -> None:
    join = empty('ab')
    join.add('a', 1, 'first')
    join.add('a', 1, 'second')
    assert join.add('b', 1, 'b') == {'a': 'first', 'b': 'b'}
    assert join.add('a', 1, 'third') is join.add('b', 1, 'b') is None
    for stamp in (2, 3):
        join.add('a', stamp, 'x')
    assert join.add('a', 2, 'again') is None
    assert [join.add('b', stamp, 'x') for stamp in (2, 3)] == [{'a': 'x', 'b': 'x'}] * 2
    assert (len(join), counts(join)) == (0, NOTHING)
    assert join.again == {'a': 3, 'b': 1}


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize(
    'stamps',
    [
        (1, 3, 2, 4, 5, 6, 7),
        (1, 2, 5, 3, 4, 6, 7),
        (1, 2, 4, 3, 6, 5, 7),
        (1, 7, 6, 5, 4, 3, 2),
    ],
    ids=['one', 'two in a row', 'two', 'all'],
)
def test_parts_of_late_frames_are_joined_in_all_topics(stamps: tuple[int, ...], seed: int) -> None:
    random = Random(seed)
    join = joined('abcd')
    taken = dict.fromkeys('abcd', 0)
    complete = []
    while min(taken.values()) < len(stamps):
        part = random.choice([p for p in 'abcd' if taken[p] < len(stamps)])
        parts = join.add(part, 10 + stamps[taken[part]], taken[part])
        taken[part] += 1
        if parts:
            assert len(set(parts.values())) == 1
            complete.append(parts['a'])
    assert sorted(complete) == list(range(len(stamps)))
    assert (len(join), counts(join)) == (0, NOTHING)


def test_a_late_frame_that_a_stage_says_nothing_of_is_dropped_with_the_next() -> None:
    join = joined('ab')
    for stamp in (12, 11, 13):
        join.add('a', stamp, 'x')
    assert join.add('b', 12, 'x') is not None
    assert counts(join) == NOTHING
    assert join.add('b', 13, 'x') is not None
    assert (len(join), counts(join)) == (0, ({}, {'tracker': 1}))


def test_of_several_parts_that_have_passed_the_first_is_named() -> None:
    # In the order of the work, not in that of a set, which differs from run to run.
    join = ExactJoin({'first': ['a', 'b', 'c', 'd', 'e'], 'last': ['z']}, 10)
    for part in 'abcdez':
        join.add(part, 1, part)
    for part in 'abcde':
        join.add(part, 3, part)
    join.add('z', 2, 'z')
    assert (join.missed, join.skipped) == ({'a': 1}, {})
