# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading
import time

import pytest

from gait_segmentation.people import TaskPool


@pytest.mark.parametrize('threads', [1, 3])
def test_results_come_in_the_order_of_the_tasks(threads: int) -> None:
    pool = TaskPool(threads)
    assert pool.run([lambda k=k: k * k for k in range(20)]) == [k * k for k in range(20)]
    assert pool.run([]) == []


def test_the_first_error_is_raised_when_all_tasks_are_done() -> None:
    done, failed = [], threading.Event()

    def slow() -> None:
        failed.wait(60)
        time.sleep(0.1)
        done.append(1)

    def fail(word: str) -> None:
        failed.set()
        raise ValueError(word)

    tasks = [lambda: fail('first'), lambda: fail('second'), slow]
    with pytest.raises(ValueError, match='first'):
        TaskPool(2).run(tasks)
    assert done == [1]


def test_tasks_run_at_the_same_time() -> None:
    meeting = threading.Barrier(2, timeout=300)
    places = TaskPool(2).run([meeting.wait, meeting.wait])
    assert sorted(places) == [0, 1]
