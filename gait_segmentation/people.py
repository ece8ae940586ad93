# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several people: how many are tracked at a time, and threads that share the work."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TypeVar

from gait_segmentation.config import StageConfig, parameter

MOST_PEOPLE = 16
"""Slots there can be."""

TaskResult = TypeVar('TaskResult')


@dataclass(frozen=True)
class PeopleConfig(StageConfig):
    """What all stages must agree on."""

    max_people: int = parameter(
        1,
        'People tracked at a time (slots person_0, ...); the same for all nodes.',
        minimum=1,
        maximum=MOST_PEOPLE,
        fixed=True,
    )
    people_threads: int = parameter(
        2,
        'Threads among which matching and segmentation divide several people. The results '
        'do not depend on it.',
        minimum=1,
        maximum=MOST_PEOPLE,
        fixed=True,
    )


def slot_name(slot: int) -> str:
    """Return the name of a slot, a place for one tracked person at a time."""
    return f'person_{slot}'


class TaskPool:
    """
    Runs tasks, several at a time if there are several.

    The kernels and OpenCV let go of the interpreter's lock while they compute.  Tasks must not
    touch what others touch; the results then do not depend on who was first.
    """

    def __init__(self, threads: int) -> None:
        """Prepare for a number of threads; with one, everything is done by the caller."""
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix='people')

    def run(self, tasks: Sequence[Callable[[], TaskResult]]) -> list[TaskResult]:
        """Return all results, in order, when all is done, or raise the first error of them."""
        if self._threads < 2 or len(tasks) < 2:
            return [task() for task in tasks]
        futures = [self._pool.submit(task) for task in tasks]
        wait(futures)
        return [future.result() for future in futures]
