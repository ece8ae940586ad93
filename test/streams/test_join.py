# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from random import Random

import pytest

from gait_segmentation.streams.join import ExactJoin

STAGES = {'camera': 'a', 'tracker': 'b', 'matcher': 'cd'}


def joined(capacity: int = 8) -> ExactJoin:
    """Return a join that has been complete at stamp 10."""
    join = ExactJoin(STAGES, capacity)
    assert [join.add(part, 10, 'x') for part in 'abcd'][-1] is not None
    return join


@pytest.mark.parametrize('seed', range(20))
def test_what_is_on_the_way_when_stamps_jump_back_is_not_lost(seed: int) -> None:
    random = Random(seed)
    stamps = [*range(10, 30), *range(10, 30), *range(5, 15)]
    join = ExactJoin(STAGES, 8)
    taken = dict.fromkeys('abcd', 0)
    found = []
    while min(taken.values()) < len(stamps):
        # In life, too, nobody is far behind the camera.
        part = random.choice(
            [p for p in 'abcd' if taken[p] < min(len(stamps), min(taken.values()) + 5)]
        )
        parts = join.add(part, stamps[taken[part]], taken[part])
        taken[part] += 1
        if parts:
            assert len(set(parts.values())) == 1
            found.append(parts['a'])
    assert sorted(found) == list(range(len(stamps)))
    assert (len(join), join.dropped) == (0, {})


def test_what_is_dropped_is_counted_by_the_first_node_it_lacks_a_part_of() -> None:
    join = joined()
    for stamp in (11, 12, 13):
        join.add('a', stamp, 'x')
    # The tracker skips 11, the matcher 12.
    for part, stamp in (('b', 12), ('b', 13), ('c', 13)):
        join.add(part, stamp, 'x')
    assert join.add('d', 13, 'x') is not None
    assert (len(join), join.dropped) == (0, {'tracker': 1, 'matcher': 1})


def test_an_entry_is_counted_once_however_late_its_parts_come() -> None:
    join = joined()
    join.add('a', 11, 'x')
    for stamp in (12, 13):
        for part in 'abcd':
            join.add(part, stamp, 'x')
        assert join.add('b', 11, 'x') is None
    assert join.dropped == {'tracker': 1}


@pytest.mark.parametrize('begun', [False, True])
def test_what_there_is_no_room_for_is_a_loss_once_anything_was_complete(begun: bool) -> None:
    join = joined(2) if begun else ExactJoin(STAGES, 2)
    for stamp in range(11, 16):
        join.add('a', stamp, 'x')
    assert join.waits_for == 'tracker'
    assert (len(join), join.dropped) == (2, {'tracker': 3} if begun else {})


def test_a_node_whose_parts_wait_is_not_waited_for() -> None:
    join = joined()
    assert join.waits_for == ''
    join.add('a', 11, 'x')
    join.add('b', 11, 'x')
    # The rest of what was dropped before.
    join.add('b', 9, 'x')
    assert join.waits_for == 'matcher'


def test_of_a_part_that_comes_twice_the_first_counts() -> None:
    join = ExactJoin({'camera': 'a', 'tracker': 'b'}, 8)
    join.add('a', 1, 'first')
    assert join.add('a', 1, 'second') is None
    assert join.add('b', 1, 'b') == {'a': 'first', 'b': 'b'}
