# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs into their outputs: one after another, in processes, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from multiprocessing.managers import SyncManager
from pathlib import Path
from typing import Any

import cv2

from gait_segmentation import MOST_PIXELS
from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.lockstep import Replayed, ahead, results_of
from gait_segmentation.cli.replaying.outputs import (
    About,
    CsvOutput,
    MasksOutput,
    Output,
    OverlayOutput,
    partial_path,
    remove,
)
from gait_segmentation.cli.replaying.walks import OpenGaitOutput
from gait_segmentation.cli.tool import POLL_S, scaled_box
from gait_segmentation.detector.client import Detector
from gait_segmentation.errors import ConfigError, GaitSegmentationError
from gait_segmentation.files.output_files import keep_apart, named, problem_of
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import DamagedError, Frame, ImageSource, open_input
from gait_segmentation.inputs.heat_maps import RecordedMap, RecordedMaps, open_heat_maps
from gait_segmentation.kernels import compile_kernels, compiling
from gait_segmentation.pipeline import Pipeline, PipelineConfig

OUTPUTS: tuple[type[Output], ...] = (
    BagOutput,
    MasksOutput,
    OverlayOutput,
    CsvOutput,
    OpenGaitOutput,
)
"""What an input can be replayed into; each has an option of the command."""

_MOST_NOTES = 10
_ASK_S = 0.2
"""How often a worker asks whether it is to break off."""


@dataclass(frozen=True)
class Job:
    """
    An input, how to read and run it, and where its outputs go.

    ``outputs`` has the bag and what else is wanted; ``reading`` are arguments of
    :func:`open_input`; ``box`` is in pixels of the input;
    ``heat_map`` is a folder, or a topic of the bag; ``detector`` is one of :data:`DETECTORS`.
    """

    input: Path
    config: PipelineConfig
    outputs: Mapping[type[Output], Path]
    reading: Mapping[str, Any] = field(default_factory=dict)
    bank: str = ''
    box: Box | None = None
    threads: int = 1
    heat_map: str = ''
    detector: str = 'none'

    @property
    def bag(self) -> Path:
        """Return the folder of the bag."""
        return self.outputs[BagOutput]

    def missing(self, *, force: bool = False) -> dict[type[Output], Path]:
        """Return the outputs that are not there, or with ``force`` all."""
        return {
            kind: path for kind, path in self.outputs.items() if force or not kind.is_there(path)
        }

    def check(self, inputs: Iterable[Path]) -> None:
        """
        Look at the places of all outputs, before anything is written.

        :param inputs: all that the command reads.
        :raises ConfigError: if one would change an input.
        :raises SequenceError: if a place is taken by something else.
        """
        for kind, path in self.outputs.items():
            keep_apart([(kind.option, each) for each in (path, partial_path(path))], inputs)
        for kind, path in self.outputs.items():
            kind.check(path)

    def source(self) -> ImageSource:
        """Open the input."""
        return open_input(self.input, **self.reading)

    def anywhere(self) -> Job:
        """Return the same job with paths that hold whatever the folder of a process is."""
        here = Path.cwd()
        is_folder = self.heat_map and Path(self.heat_map).is_dir()
        return replace(
            self,
            input=here / self.input,
            outputs={kind: here / path for kind, path in self.outputs.items()},
            bank=self.bank and str(here / self.bank),
            heat_map=str(here / self.heat_map) if is_folder else self.heat_map,
        )


@dataclass
class Report:
    """
    How a replay went.

    ``seen`` counts the frames that show somebody.  ``error`` says why it ended before its time,
    ``damaged`` where the input breaks off, ``left`` which outputs were left incomplete, and
    ``notes`` what else there is to know; ``unsaid`` counts the notes that were not kept.
    """

    input: Path
    frames: int = 0
    seen: int = 0
    damaged: str = ''
    interrupted: bool = False
    error: str = ''
    left: list[Path] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    unsaid: int = 0

    def note(self, text: str) -> None:
        """Add a note, unless there are many already."""
        if len(self.notes) < _MOST_NOTES:
            self.notes.append(text)
        else:
            self.unsaid += 1


def replay(
    job: Job,
    bank: TemplateBank,
    stop: Callable[[], bool],
    *,
    force: bool = False,
    shown: Callable[[Iterable[Replayed], int | None], Iterable[Replayed]] = lambda each, _: each,
) -> Report:
    """
    Replay an input into those of its outputs that are not there yet.

    :param stop: says whether to break off, asked after every frame.
    :param force: make all outputs anew.
    :param shown: passes frames on, of which there are so many (None: not known), with a bar.
    :returns: how it went; errors of the input and of writing are reported, not raised.
    """
    report = Report(job.input)
    outputs: list[Output] = []
    complete = False
    try:
        cv2.setNumThreads(job.threads)
        source = job.source()
        box = scaled_box(job.box, source)
        about = About(source.size, source.fps, job.config.people.max_people)
        for kind, path in job.missing(force=force).items():
            outputs.append(kind(path, about))
        with _heat_maps(job) as maps:
            results = results_of(source, Pipeline(job.config, bank), box, report.note, maps)
            with closing(ahead(results)) as found:
                _feed(report, outputs, shown(found, source.total), stop)
        if not report.interrupted:
            for output in outputs:
                output.close(complete=True)
            complete = True
    except GaitSegmentationError as error:
        report.error = str(error)
    except OSError as error:
        report.error = problem_of(error)
    finally:
        if not complete:
            for output in outputs:
                output.close(complete=False)
            left = [partial_path(output.path) for output in outputs]
            if report.frames == 0:
                for path in left:
                    remove(path)
            report.left = [path for path in left if path.exists()]
    return report


@contextmanager
def _heat_maps(job: Job) -> Iterator[RecordedMaps | None]:
    """
    Give the heat maps that a job asks for, None if it asks for none.

    :raises GaitSegmentationError: if there are none, or what makes them cannot be started.
    """
    if job.detector != 'none':
        with Detector() as detector:
            detector.start()
            yield lambda frame: _detected(detector, frame)
    elif job.heat_map:
        most = job.reading.get('max_pixels', MOST_PIXELS)
        yield open_heat_maps(job.heat_map, job.input, most)
    else:
        yield None


def _detected(detector: Detector, frame: Frame) -> Iterator[RecordedMap]:
    image = frame.image
    if image is not None:
        # Not left to the map: what cannot be started again ends the replay.
        detector.start()
        yield frame.stamp_ns, lambda: detector.map_of(image)


def _feed(
    report: Report, outputs: list[Output], results: Iterable[Replayed], stop: Callable[[], bool]
) -> None:
    """Feed the outputs, to the end of the input or until there is to be a stop."""
    try:
        for frame, result in results:
            for output in outputs:
                with named(output.path):
                    output.add(frame, result)
            report.frames += 1
            report.seen += any(each.track.box is not None for each in result.people)
            if stop():
                report.interrupted = True
                return
    except DamagedError as error:
        report.damaged = str(error)


def replay_all(jobs: list[Job], at_a_time: int, *, force: bool, cluster: str = '') -> list[Report]:
    """
    Replay inputs until all are done, or a signal to end comes.

    :param jobs: at least one; all have the same configuration and bank.
    :param at_a_time: how many are worked on at a time, in processes of their own if several.
    :param force: make all outputs anew.
    :param cluster: address of a Dask scheduler whose workers do it instead.
    :returns: how those went that were begun.
    :raises BankError: if the bank cannot be read.
    :raises ConfigError: if there is no cluster at the address.
    """
    bank = open_bank(jobs[0].bank)
    if cluster:
        return _on_cluster(jobs, cluster, force)
    # Before signals are only looked at between frames; and once for all processes.
    with compiling(lambda text: print(f'gait_replay: {text}', file=sys.stderr)):
        compile_kernels()
    if at_a_time > 1 and len(jobs) > 1:
        return _in_processes(jobs, min(at_a_time, len(jobs)), force)
    reports: list[Report] = []
    with _until_interrupted() as stop:
        for job in jobs:

            def shown(frames: Iterable[Replayed], total: int | None, job: Job = job) -> Any:
                return _bar(frames, total=total, unit='frame', desc=job.bag.name)

            reports.append(replay(job, bank, stop.is_set, force=force, shown=shown))
            if stop.is_set():
                break
    return reports


def _bar(items: Iterable[Any] | None = None, **options: Any) -> Any:
    # Here, so that it is said what to install where it is not there.
    from tqdm import tqdm

    # disable=None: no bar where stderr is not a terminal.
    return tqdm(items, disable=None, leave=False, **options)


@contextmanager
def _until_interrupted() -> Iterator[threading.Event]:
    """Give an event that a signal to end sets; a second one interrupts as Ctrl-C does."""
    stop = threading.Event()

    def handle(number: int, _frame: Any) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    before = {
        number: signal.getsignal(number)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    try:
        for number, handler in before.items():
            # What nohup has begun is to survive its terminal.
            if number != signal.SIGHUP or handler != signal.SIG_IGN:
                signal.signal(number, handle)
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _in_processes(jobs: list[Job], processes: int, force: bool) -> list[Report]:
    context = multiprocessing.get_context('spawn')
    manager = SyncManager(ctx=context)
    manager.start(_begin_worker)
    with manager, ProcessPoolExecutor(processes, context, _begin_worker) as pool:
        return _share_out(jobs, pool, manager.Event(), force)


def _begin_worker() -> None:
    # Ctrl-C in a terminal reaches all processes; the parent alone decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGKILL)


def _on_cluster(jobs: list[Job], address: str, force: bool) -> list[Report]:
    from distributed import Client, Event

    try:
        client = Client(address, set_as_default=False)
    except (OSError, TypeError, ValueError) as error:
        raise ConfigError(f'--dask {address}: there is no Dask scheduler: {error}') from error
    with client:
        if not client.nthreads():
            print(f'gait_replay: {address} has no workers yet: waiting for them', file=sys.stderr)
        jobs = [job.anywhere() for job in jobs]
        pool, halt = client.get_executor(pure=False), Event(client=client)
        return _share_out(jobs, pool, halt, force, lambda: bool(client.nthreads()))


def _share_out(
    jobs: list[Job],
    pool: Executor,
    halt: Any,
    force: bool,
    has_workers: Callable[[], bool] = lambda: True,
) -> list[Report]:
    """
    Have workers replay inputs.

    :param halt: an event that they see as well, for breaking off.
    :param has_workers: says whether anybody is there to see it.
    """
    futures: dict[Future[Report | None], Job] = {}
    try:
        with _until_interrupted() as stop, _bar(total=len(jobs), unit='input') as bar:
            futures |= {pool.submit(replay_task, job, halt, force): job for job in jobs}
            waiting = set(futures)
            while waiting and not (stop.is_set() and not has_workers()):
                done, waiting = wait(waiting, POLL_S, FIRST_COMPLETED)
                bar.update(len(done))
                if stop.is_set():
                    halt.set()
            # Of those that nobody has begun, nor ever will.
            for future in waiting:
                future.cancel()
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    ended = (each for each in futures.items() if each[0] not in waiting)
    reports = (_report_of(future, job) for future, job in ended)
    return [report for report in reports if report is not None]


def replay_task(job: Job, halt: Any, force: bool) -> Report | None:
    """
    Replay an input in a worker.

    :param halt: an event that breaks off what has begun, and begins nothing more.
    :returns: how it went, None if it was not begun.
    """
    if halt.is_set():
        return None
    return replay(job, _prepared(job.bank), _now_and_then(halt.is_set), force=force)


def _report_of(future: Future[Report | None], job: Job) -> Report | None:
    """Return what a worker that is done has returned, or a report of what became of it."""
    if future.cancelled():
        return Report(job.input, error='the cluster is gone')
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, BrokenProcessPool):
        text = 'a process was killed, as when memory runs out: the same command, with fewer '
        return Report(job.input, error=f'{text}--jobs, does what is left')
    # Of Dask, which has tried it on others.
    failures = getattr(error, 'allowed_failures', None)
    text = f'{type(error).__name__}: {error}'
    return Report(job.input, error=text if failures is None else f'{failures + 1} workers died')


@cache
def _prepared(bank: str) -> TemplateBank:
    """Open a bank, once in a process, and compile the kernels if that was not done."""
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
