# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from gait_segmentation.streams.backlog import Worker

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
