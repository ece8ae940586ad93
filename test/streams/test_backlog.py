# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading

import pytest

from gait_segmentation.streams.backlog import CAUGHT_UP, Backlog, Worker

TIMEOUT_S = 10.0


def taken(backlog: Backlog) -> list[object]:
    """Return the frames that wait, once the calls are made."""
    items: list[object] = []
    worker = Worker(backlog, items.append, lambda error: None)
    assert backlog.drain(TIMEOUT_S)
    worker.stop()
    return items


@pytest.mark.parametrize(
    ('count', 'dropped', 'left'), [(3, [0] * 3, [0, 1, 2]), (4, [0, 0, 0, 3], [3])]
)
def test_up_to_the_limit_nothing_is_lost_and_then_all_but_the_newest(
    count: int, dropped: list[int], left: list[int]
) -> None:
    backlog = Backlog(3)
    assert [backlog.put(n) for n in range(count)] == dropped
    assert taken(backlog) == left


def test_who_cannot_keep_up_gets_evenly_spaced_new_frames() -> None:
    backlog = Backlog(5)
    worked: list[tuple[int, int]] = []
    dropped = 0
    for number in range(60):
        dropped += backlog.put(number)
        if number % 3 == 2:
            taken_now = backlog.take()
            assert isinstance(taken_now, tuple)
            worked.append((number, taken_now[0]))
    settled = worked[len(worked) // 2 :]
    assert all(now == frame for now, frame in settled)
    assert len(worked) + dropped + len(taken(backlog)) == 60


def keep_up(backlog: Backlog, frames: int) -> None:
    for number in range(frames):
        backlog.put(number)
        backlog.take()
        backlog.call(lambda: None)
        backlog.take()


def behind(limit: int) -> Backlog:
    backlog = Backlog(limit)
    for number in range(limit + 1):
        backlog.put(number)
    backlog.take()
    return backlog


def test_after_the_work_has_caught_up_frames_wait_again() -> None:
    backlog = behind(3)
    keep_up(backlog, CAUGHT_UP - 2)
    assert [backlog.put(n) for n in range(3)] == [0, 1, 1]
    backlog.take()
    keep_up(backlog, CAUGHT_UP)
    assert [backlog.put(n) for n in range(3)] == [0, 0, 0]


def test_the_work_has_not_caught_up_by_calls_nor_while_frames_wait() -> None:
    backlog, called = behind(3), behind(3)
    for number in range(2 * CAUGHT_UP):
        backlog.put(number)
        backlog.take()
        called.call(lambda: None)
        called.take()
    for each in (backlog, called):
        assert [each.put(n) for n in range(2)] == [0, 1]


def test_after_another_overflow_catching_up_begins_anew() -> None:
    backlog = behind(3)
    for _ in range(3):
        keep_up(backlog, CAUGHT_UP - 3)
        assert [backlog.put(n) for n in range(2)] == [0, 1]
        backlog.take()
        backlog.call(lambda: None)
        backlog.take()


def test_calls_go_first_and_are_never_dropped() -> None:
    backlog = Backlog(1)
    done: list[str] = []
    backlog.put('a')
    backlog.call(lambda: done.append('first'))
    backlog.put('b')
    backlog.call(lambda: done.append('second'))
    backlog.take()()
    backlog.take()()
    assert done == ['first', 'second']
    assert backlog.take() == ('b',)


def test_of_the_calls_of_a_kind_the_newest_wait() -> None:
    backlog = Backlog(1)
    done: list[object] = []

    def call(name: str, kind: str, most: int = 1) -> int:
        return backlog.call(lambda: done.append(name), kind, most)

    assert [call(f'box {n}', 'box', 2) for n in range(5)] == [0, 0, 1, 1, 1]
    assert [call('reset 0', 'reset'), call('box 5', 'box', 2), call('reset 1', 'reset')] == [
        0,
        1,
        1,
    ]
    backlog.call(lambda: done.append('finish'))
    backlog.call(lambda: done.append('finish'))
    assert taken(backlog) == []
    assert done == ['box 4', 'box 5', 'reset 1', 'finish', 'finish']


def test_drain_waits_for_the_frame_in_work() -> None:
    go = threading.Event()
    worker = Worker(Backlog(3), lambda frame: go.wait(TIMEOUT_S), lambda error: None)
    worker.backlog.put(1)
    assert not worker.backlog.drain(0.01)
    go.set()
    assert worker.backlog.drain(TIMEOUT_S)
    worker.stop()


def test_an_error_that_is_let_through_is_handed_on() -> None:
    failed = threading.Event()
    errors: list[BaseException] = []

    def fail(frame: object) -> None:
        raise RuntimeError('broken')

    def note(error: BaseException) -> None:
        errors.append(error)
        failed.set()

    worker = Worker(Backlog(3), fail, note)
    worker.backlog.put(1)
    assert failed.wait(TIMEOUT_S)
    # Nobody waits for what nobody will do.
    worker.backlog.put(2)
    assert worker.backlog.drain(0.0)
    worker.stop()
    assert [str(error) for error in errors] == ['broken']
