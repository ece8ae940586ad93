# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A few threads that share work on several people.

The kernels and OpenCV let go of the interpreter's lock while they compute, so that threads run at
the same time.  Tasks must not touch what others touch; the results then do not depend on who was
first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ['Crew']

Result = TypeVar('Result')


class Crew:
    """Runs tasks, several at a time if there are several."""

    def __init__(self, threads: int) -> None:
        """Prepare for a number of threads; with one, everything is done by the caller."""
        self._threads = threads
        self._pool: ThreadPoolExecutor | None = None

    def run(self, tasks: Sequence[Callable[[], Result]]) -> list[Result]:
        """
        Return the results of all tasks in their order, when all are done.

        An error of a task is raised then; of several, that of the first in the order.
        """
        if self._threads < 2 or len(tasks) < 2:
            return [task() for task in tasks]
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._threads, thread_name_prefix='crew')
        futures = [self._pool.submit(task) for task in tasks]
        errors = [error for future in futures if (error := future.exception()) is not None]
        if errors:
            raise errors[0]
        return [future.result() for future in futures]
