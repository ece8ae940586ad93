# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs as tasks of a Dask cluster, which does those of a worker that dies again elsewhere."""

from __future__ import annotations

import fcntl
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

from distributed import Client, Event, KilledWorker

from gait_segmentation.cli.replaying.job import Job, Report, replay
from gait_segmentation.errors import ConfigError
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.kernels import compile_kernels

__all__ = ['Event', 'anywhere', 'connected', 'replay_task', 'report_of']

_ASK_S = 1.0
"""How often a task asks the scheduler whether it is to break off."""


@contextmanager
def connected(address: str) -> Iterator[Client]:
    """
    Connect to the scheduler of a cluster.

    :raises ConfigError: if there is none.
    """
    try:
        client = Client(address, set_as_default=False)
    except (OSError, TypeError, ValueError) as error:
        raise ConfigError(f'--dask {address}: there is no Dask scheduler: {error}') from error
    with client:
        if not client.nthreads():
            print(f'gait_replay: {address} has no workers yet: waiting for them', file=sys.stderr)
        yield client


def anywhere(job: Job) -> Job:
    """Return the same job with paths that hold whatever the folder of a process is."""
    here = Path.cwd()
    maps = here / job.heat_map
    return replace(
        job,
        input=here / job.input,
        outputs={kind: here / path for kind, path in job.outputs.items()},
        bank=job.bank and str(here / job.bank),
        heat_map=str(maps) if job.heat_map and maps.is_dir() else job.heat_map,
    )


def replay_task(job: Job, halt: Event, *, force: bool) -> Report | None:
    """
    Replay an input in a worker.

    :param halt: breaks off what has begun, and begins nothing more.
    :returns: how it went, None if it was not begun.
    """
    if halt.is_set():
        return None
    return replay(job, _prepared(job.bank), _now_and_then(halt.is_set), force=force)


def report_of(job: Job, future: Future[Report | None]) -> Report | None:
    """Return what a task that is done has returned, or a report of what became of it."""
    if future.cancelled():
        return Report(job.input, error='the cluster is gone')
    error = future.exception()
    if isinstance(error, KilledWorker):
        return Report(job.input, error=f'{error.allowed_failures + 1} workers died of it')
    if error is not None:
        return Report(job.input, error=f'{type(error).__name__}: {error}')
    return future.result()


@cache
def _prepared(bank: str) -> TemplateBank:
    """Open a bank and compile the kernels, for which the processes of a machine take turns."""
    lock = Path(tempfile.gettempdir()) / f'gait_segmentation-{os.getuid()}.lock'
    with lock.open('a') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        compile_kernels()
        return open_bank(bank)


def _now_and_then(ask: Callable[[], bool]) -> Callable[[], bool]:
    """Return the answer to a question, or False where it was asked a moment ago."""
    due = 0.0

    def asked() -> bool:
        nonlocal due
        if time.monotonic() < due:
            return False
        due = time.monotonic() + _ASK_S
        return ask()

    return asked
