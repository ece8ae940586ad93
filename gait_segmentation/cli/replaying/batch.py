# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several inputs, one after another or side by side, until Ctrl-C."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from tqdm import tqdm

from gait_segmentation.cli.replaying.job import Job, Report, replay
from gait_segmentation.cli.tool import POLL_S
from gait_segmentation.commands import ENDING
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.kernels import compile_kernels, compiling

__all__ = ['replay_all']

_KILLED = 'a process was killed, as when memory runs out'


def replay_all(
    jobs: list[Job], at_a_time: int, *, force: bool, cluster: str = ''
) -> tuple[list[Report], float]:
    """
    Replay inputs until all are done, or a signal to end comes.

    :param jobs: at least one; all have the same configuration and bank.
    :param at_a_time: how many are worked on at a time, in processes of their own if several.
    :param force: make all outputs anew.
    :param cluster: address of a Dask scheduler whose workers do it instead.
    :returns: how those went that were begun, and how many seconds they took in all.
    :raises BankError: if the bank cannot be read.
    :raises ConfigError: if there is no cluster at the address.
    """
    totals = [_total(job) for job in jobs]
    bank = open_bank(jobs[0].bank)
    if not cluster and any(total != 0 for total in totals):
        # Before signals are only looked at between frames; and once for all processes.
        with compiling(lambda text: print(f'gait_replay: {text}', file=sys.stderr)):
            compile_kernels()
    started = time.monotonic()
    if cluster:
        reports = _on_cluster(jobs, totals, cluster, force)
    elif at_a_time == 1 or len(jobs) == 1:
        reports = _in_turn(jobs, totals, bank, force)
    else:
        reports = _side_by_side(jobs, totals, min(at_a_time, len(jobs)), force)
    return reports, time.monotonic() - started


def _total(job: Job) -> int | None:
    """Return how many frames there are, None if that is not known, 0 for what is no input."""
    try:
        return job.source().total
    except (GaitSegmentationError, OSError):
        return 0


@contextmanager
def _until_interrupted() -> Iterator[threading.Event]:
    """Give an event that a signal to end sets; a second one interrupts as Ctrl-C does."""
    stop = threading.Event()

    def handle(number: int, _frame: Any) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    before = {number: signal.getsignal(number) for number in ENDING}
    try:
        for number, handler in before.items():
            # What nohup has begun is to survive its terminal.
            if number != signal.SIGHUP or handler != signal.SIG_IGN:
                signal.signal(number, handle)
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _in_turn(
    jobs: list[Job], totals: list[int | None], bank: TemplateBank, force: bool
) -> list[Report]:
    reports: list[Report] = []
    with _until_interrupted() as stop:
        for job, total in zip(jobs, totals, strict=True):
            # disable=None: no bar where stderr is not a terminal.
            with tqdm(
                total=total, unit='frame', desc=job.bag.name, disable=None, leave=False
            ) as bar:
                reports.append(replay(job, bank, stop.is_set, force=force, progress=bar.update))
            if stop.is_set():
                break
    return reports


def _side_by_side(
    jobs: list[Job], totals: list[int | None], processes: int, force: bool
) -> list[Report]:
    """
    Replay in processes.

    Where one is killed, what was not done is done again by half as many, and at last by one.
    """
    reports: dict[Path, Report] = {}
    with _until_interrupted() as stop:
        while jobs and not stop.is_set():
            found = _in_processes(jobs, totals, processes, force, stop)
            reports |= {report.input: report for report in found.values()}
            left = [number for number in range(len(jobs)) if number not in found]
            if left and not stop.is_set():
                if processes == 1:
                    culprit = jobs[left.pop(0)].input
                    reports[culprit] = Report(culprit, error=_KILLED)
                processes = max(processes // 2, 1)
                print(f'gait_replay: {_KILLED}: {len(left)} inputs to do again', file=sys.stderr)
            jobs, totals = [jobs[each] for each in left], [totals[each] for each in left]
    return list(reports.values())


def _in_processes(
    jobs: list[Job],
    totals: list[int | None],
    processes: int,
    force: bool,
    stop: threading.Event,
) -> dict[int, Report]:
    """
    Replay in processes; they are told of an interruption by a shared event.

    :returns: how those went, by their number, that were begun and whose process was not killed.
    """
    # Each time anew, since who is killed may hold a lock.
    context = multiprocessing.get_context('spawn')
    halt = context.Event()
    done = context.Value('Q', 0)
    futures: list[Future[Report | None]] = []
    with (
        ProcessPoolExecutor(processes, context, _begin_worker, (halt, done, jobs[0].bank)) as pool,
        suppress(BrokenProcessPool),
    ):
        futures += (pool.submit(_replay_in_worker, job, force) for job in jobs)
        _show_progress(futures, totals, lambda: done.get_obj().value, stop, halt.set)
    found = {}
    for number, future in enumerate(futures):
        with suppress(BrokenProcessPool):
            if (report := future.result()) is not None:
                found[number] = report
    return found


def _on_cluster(
    jobs: list[Job], totals: list[int | None], address: str, force: bool
) -> list[Report]:
    """Replay in the workers of a cluster; an error of one is reported with its input."""
    from gait_segmentation.cli.replaying import cluster

    with cluster.connected(address) as client, _until_interrupted() as stop:
        halt = cluster.Event(client=client)
        pool = client.get_executor(pure=False)
        jobs = [cluster.anywhere(job) for job in jobs]
        futures = [pool.submit(cluster.replay_task, job, halt, force=force) for job in jobs]

        def reports() -> list[Report]:
            pairs = zip(jobs, futures, strict=True)
            found = (cluster.report_of(job, future) for job, future in pairs if future.done())
            return [report for report in found if report is not None]

        def break_off() -> None:
            halt.set()
            if not client.nthreads():
                # Nothing has begun that could be waited for.
                raise KeyboardInterrupt

        _show_progress(
            futures, totals, lambda: sum(each.frames for each in reports()), stop, break_off
        )
        return reports()


def _show_progress(
    futures: list[Future[Report | None]],
    totals: list[int | None],
    frames: Callable[[], int],
    stop: threading.Event,
    halt: Callable[[], None],
) -> None:
    """
    Show how far inputs are until all are done.

    :param frames: counts those that are done.
    :param halt: called once interrupted; then no more inputs are begun.
    """
    known = None if None in totals else sum(total for total in totals if total is not None)
    waiting = set(futures)
    with tqdm(total=known, unit='frame', disable=None, leave=False) as bar:
        while waiting:
            waiting = wait(waiting, POLL_S, FIRST_COMPLETED).not_done
            bar.update(frames() - bar.n)
            if stop.is_set():
                halt()


_WORKER: dict[str, Any] = {}
"""Of a process: the event that breaks off, the count of frames, and the bank."""


def _begin_worker(halt: Any, done: Any, bank: str) -> None:
    # Ctrl-C in a terminal reaches all processes; the parent alone decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Of inputs the parent has looked at before.
    logging.getLogger('gait_segmentation').setLevel(logging.ERROR)
    _WORKER.update(halt=halt, done=done, bank=open_bank(bank))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGKILL)


def _replay_in_worker(job: Job, force: bool) -> Report | None:
    """Replay an input, unless interrupted before."""

    def count() -> None:
        with _WORKER['done'].get_lock():
            _WORKER['done'].value += 1

    halt = _WORKER['halt'].is_set
    return None if halt() else replay(job, _WORKER['bank'], halt, force=force, progress=count)
