# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import itertools
import queue
import threading
import time
from collections.abc import Iterator
from random import Random

import pytest

from gait_segmentation.ros.frames import ExactJoin, Worker

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
    assert (len(join._entries), join.dropped) == (0, {})


def test_what_is_dropped_is_counted_by_the_first_node_it_lacks_a_part_of() -> None:
    join = joined()
    for stamp in (11, 12, 13):
        join.add('a', stamp, 'x')
    # The tracker skips 11, the matcher 12.
    for part, stamp in (('b', 12), ('b', 13), ('c', 13)):
        join.add(part, stamp, 'x')
    assert join.add('d', 13, 'x') is not None
    assert (len(join._entries), join.dropped) == (0, {'tracker': 1, 'matcher': 1})


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
    assert (len(join._entries), join.dropped) == (2, {'tracker': 3} if begun else {})
    # The oldest of all are lost.
    assert all([join.add(part, stamp, 'x') for part in 'bcd'][-1] for stamp in (14, 15))


def test_a_node_whose_parts_wait_is_not_waited_for() -> None:
    join = joined()
    assert join.waits_for == ''
    join.add('a', 11, 'x')
    join.add('b', 11, 'x')
    # The rest of what was dropped before.
    join.add('b', 9, 'x')
    assert join.waits_for == 'matcher'
    # What holds up the newest is what is missing now.
    join.add('a', 12, 'x')
    assert join.waits_for == 'tracker'


def test_of_a_part_that_comes_twice_the_first_counts() -> None:
    join = ExactJoin({'camera': 'a', 'tracker': 'b'}, 8)
    join.add('a', 1, 'first')
    assert join.add('a', 1, 'second') is None
    assert join.add('b', 1, 'b') == {'a': 'first', 'b': 'b'}


TIMEOUT_S = 10.0


class Busy:
    """A worker that is busy until it is let go, and what it has done."""

    def __init__(self, limit: int) -> None:
        self.done: list[object] = []
        self.go = threading.Event()
        self.worker = Worker(limit, self.done.append)
        begun = threading.Event()

        def wait() -> None:
            begun.set()
            self.go.wait(TIMEOUT_S)

        self.worker.call(wait)
        assert begun.wait(TIMEOUT_S)

    def finished(self) -> list[object]:
        self.go.set()
        assert self.worker.drain(TIMEOUT_S)
        return self.done


@pytest.fixture
def busy() -> Iterator[Busy]:
    made = Busy(3)
    yield made
    made.go.set()
    made.worker.stop()


@pytest.mark.parametrize(
    ('count', 'dropped', 'left'),
    [(3, [0] * 3, [0, 1, 2]), (5, [0, 0, 0, 3, 0], [3, 4])],
)
def test_up_to_the_limit_nothing_is_lost_and_then_all_but_the_newest(
    busy: Busy, count: int, dropped: list[int], left: list[int]
) -> None:
    assert [busy.worker.put(n) for n in range(count)] == dropped
    assert busy.finished() == left


def test_without_a_limit_ten_may_wait_for_a_moment() -> None:
    busy = Busy(0)
    assert [busy.worker.put(n) for n in range(11)] == [0] * 10 + [10]
    assert busy.finished() == [10]
    busy.worker.stop()


def test_a_few_at_once_after_a_slow_one_are_no_overload() -> None:
    done: list[int] = []
    worker = Worker(0, lambda number: (time.sleep(0.02), done.append(number)))
    for number in range(9):
        # Two at once, of which the first has not been worked on.
        assert worker.put(number) == 0
        if number % 2 == 0:
            assert worker.drain(TIMEOUT_S)
    assert worker.drain(TIMEOUT_S)
    assert (done, worker.load) == (list(range(9)), 0.0)
    worker.stop()


def test_while_frames_take_longer_than_they_come_the_newest_is_worked_on() -> None:
    now_s, done = [0.0], []
    begun, go = queue.Queue[int](), threading.Semaphore(0)

    def work(number: int) -> None:
        begun.put(number)
        assert go.acquire(timeout=TIMEOUT_S)
        done.append((number, newest))

    newest = 0
    worker = Worker(0, work, lambda: now_s[0])
    # A frame every 50 ms, each of which takes 100.
    for newest in range(60):
        now_s[0] += 0.05
        worker.put(newest)
        if newest % 2 == 0:
            if newest:
                go.release()
            begun.get(timeout=TIMEOUT_S)
    assert (worker.took_s, worker.step_s) == (pytest.approx(0.1), pytest.approx(0.05))
    numbers = [number for number, _ in done][-20:]
    assert {later - number for number, later in itertools.pairwise(numbers)} == {2}
    assert all(last - number == 2 for number, last in done[-20:])
    # When they come more rarely none is lost any more.
    for newest in range(60, 100):
        go.release()
        now_s[0] += 0.2
        lost = worker.put(newest)
    assert (lost, worker.step_s) == (0, pytest.approx(0.2))
    go.release(100)
    worker.stop()


def test_with_neither_enough_time_nor_too_little_it_is_as_before() -> None:
    now_s = due_s = 0.0
    takes_s: list[float] = []
    lost: list[int] = []

    def come() -> None:
        """Let the next frame come, 100 ms after the last."""
        nonlocal now_s, due_s
        now_s, due_s = due_s, due_s + 0.1
        lost.append(worker.put(None))

    def work(_: object) -> None:
        nonlocal now_s
        end_s = now_s + (takes_s.pop(0) if takes_s else 0.0)
        while due_s <= end_s:
            come()
        now_s = end_s

    worker = Worker(0, work, lambda: now_s)

    def lost_after(*all_s: float) -> int:
        """Return how many are lost during a long one, after 30 that took so long each."""
        for took_s in all_s:
            takes_s[:] = [took_s] * 30
            while takes_s:
                come()
                assert worker.drain(TIMEOUT_S)
        lost.clear()
        takes_s.append(0.35)
        come()
        assert worker.drain(TIMEOUT_S)
        return sum(lost)

    assert lost_after(0.09) == 0
    assert lost_after(0.2, 0.09) == 2
    assert lost_after(0.07) == 0
    worker.stop()


def test_calls_go_first_and_those_without_a_kind_are_never_dropped(busy: Busy) -> None:
    for number in range(5):
        busy.worker.put(number)
        busy.worker.call(lambda number=number: busy.done.append(f'call {number}'))
    assert busy.finished() == [*(f'call {n}' for n in range(5)), 3, 4]


def test_of_the_calls_of_a_kind_the_newest_wait(busy: Busy) -> None:
    kinds = [('box', 4)] * 7 + [('reset', 1)] * 2 + [('box', 4)]
    for number, (kind, most) in enumerate(kinds):
        name = f'{kind} {number}'
        busy.worker.call(lambda name=name: busy.done.append(name), kind, most)
    assert busy.finished() == ['box 4', 'box 5', 'box 6', 'reset 8', 'box 9']


def test_drain_waits_for_what_is_done_now(busy: Busy) -> None:
    assert not busy.worker.drain(0.01)
    busy.finished()


def test_an_error_that_is_let_through_is_handed_on(busy: Busy) -> None:
    assert busy.worker.failure is None
    busy.worker.call(lambda: [].pop())
    busy.worker.put(1)
    # Nobody waits for what nobody will do.
    assert busy.finished() == []
    assert str(busy.worker.failure) == 'pop from empty list'
