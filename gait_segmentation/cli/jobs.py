# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs into their outputs: one after another, or many at a time by Dask."""

from __future__ import annotations

import logging
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.cli.lockstep import ahead, open_heat_maps, results_of
from gait_segmentation.cli.outputs import BagOutput, Output, partial_path, remove
from gait_segmentation.cli.tool import scaled_box
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import DetectorConfig, open_networks
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.errors import ConfigError, GaitSegmentationError
from gait_segmentation.files import keep_apart, named, problem_of
from gait_segmentation.gait_model import TemplateBank, open_bank
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import DamagedError, open_input
from gait_segmentation.kernels import compile_kernels, compiling
from gait_segmentation.pipeline import Pipeline, PipelineConfig

_MOST_NOTES = 10
_ASK_S = 0.2
"""How often a worker asks whether it is to break off, and the command how its workers are."""

_CONNECT_S = 5


@dataclass(frozen=True)
class Job:
    """
    An input, how to read and run it, and where its outputs go.

    ``outputs`` has the bag and what else is wanted; ``reading`` are arguments of
    :func:`open_input`; ``box`` is in pixels of the input;
    ``heat_map`` is a folder, or a topic of the bag.
    """

    input: Path
    config: PipelineConfig
    outputs: Mapping[type[Output], Path]
    reading: Mapping[str, Any] = field(default_factory=dict)
    bank: str = ''
    box: Box | None = None
    heat_map: str = ''

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
        Check the places of all outputs, before anything is written.

        :param inputs: all that the command reads.
        :raises ConfigError: if one would change an input or another output.
        :raises SequenceError: if a place is taken by something else.
        """
        places = list(self.outputs.values())
        for number, (kind, path) in enumerate(self.outputs.items()):
            keep_apart([(kind.option, path)], places[:number], 'output')
            keep_apart([(kind.option, each) for each in (path, partial_path(path))], inputs)
            kind.check(path)


@dataclass
class Report:
    """
    How a replay went.

    ``seen`` counts the frames that show a person, and ``looked`` says who looked for people, if
    there are none; ``error`` says why it ended before its time,
    ``damaged`` where the input breaks off, ``left`` which outputs were left incomplete, and
    ``notes`` what else there is to know, the first of it.
    """

    input: Path
    frames: int = 0
    seen: int = 0
    looked: str = ''
    damaged: str = ''
    interrupted: bool = False
    error: str = ''
    left: list[Path] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Add a note, unless there are many already."""
        if len(self.notes) <= _MOST_NOTES:
            self.notes.append(text if len(self.notes) < _MOST_NOTES else 'and so on')


_CLEAR = 0.6
"""Score of somebody in a picture that is turned, from which the camera may have been."""


def _best_of(people: Sequence[Detection]) -> float:
    return max((each.score for each in people), default=0.0)


class _Looked:
    """Networks, how often they have looked for people, and the best score of these."""

    def __init__(self, config: DetectorConfig) -> None:
        self._name = config.network
        self._looks, self._best = 0, 0.0
        self._image: NDArray[np.uint8] | None = None
        networks = open_networks(config.network, config.person_class)
        self._people = networks.people
        self.networks = networks._replace(
            people=networks.people and partial(self._look, networks.people),
            closely=networks.closely and partial(self._look, networks.closely),
        )

    def _look(
        self,
        look: Callable[[NDArray[np.uint8]], Sequence[Detection]],
        image: NDArray[np.uint8],
    ) -> Sequence[Detection]:
        found = look(image)
        self._looks += 1
        self._best = max(self._best, _best_of(found))
        self._image = image
        return found

    def summary(self) -> str:
        """Say who has looked, and what they made of the images."""
        if self._people is None:
            return f'nobody looked for people (detector.network: {self._name})'
        times = 'once' if self._looks == 1 else f'{self._looks} times'
        best = f'at best with a score of {self._best:.2f}' if self._best else 'and saw nobody'
        return f'the detector ({self._name}) looked {times}, {best}{self._turned()}'

    def _turned(self) -> str:
        """Say by how much the last image is to be turned for a person to be seen in it."""
        assert self._people is not None
        if self._image is None:
            return ''
        scores = {
            90 * turns: _best_of(self._people(np.ascontiguousarray(np.rot90(self._image, -turns))))
            for turns in (1, 2, 3)
        }
        degrees, score = max(scores.items(), key=lambda each: each[1])
        if score < _CLEAR:
            return ''
        return f'; with --rotate {degrees} it sees somebody in the last image, with {score:.2f}'


def replay(
    job: Job,
    bank: TemplateBank,
    stop: Callable[[], bool],
    *,
    force: bool = False,
    shown: bool = False,
) -> Report:
    """
    Replay an input into those of its outputs that are not there yet.

    :param stop: says whether to break off, asked after every frame.
    :param force: make all outputs again.
    :param shown: have a bar show how far it is.
    :returns: how it went; errors of the input and of writing are reported, not raised.
    """
    report = Report(job.input)
    outputs: list[Output] = []
    try:
        cv2.setNumThreads(1)
        source = open_input(job.input, **job.reading)
        box = scaled_box(job.box, source)
        for kind, path in job.missing(force=force).items():
            outputs.append(kind(path, source.size, source.fps, job.config.people.max_people))
        most = job.reading.get('max_pixels', MOST_PIXELS)
        maps = open_heat_maps(job.heat_map, job.input, most) if job.heat_map else None
        looked = _Looked(job.config.detector)
        scheduler = DetectorScheduler(job.config.detector, looked.networks)
        pipeline = Pipeline(job.config, bank, scheduler=scheduler)
        results = results_of(source, pipeline, box, report.note, maps)
        with closing(ahead(results)) as found:
            bar = _bar(found, total=source.total, unit='frame', desc=job.bag.name)
            try:
                for frame, result in bar if shown else found:
                    for output in outputs:
                        with named(output.path):
                            output.add(frame, result)
                    report.frames += 1
                    report.seen += any(each.track.box is not None for each in result.people)
                    if stop():
                        report.interrupted = True
                        break
            except DamagedError as error:
                report.damaged = str(error)
        report.looked = '' if report.seen else looked.summary()
        if not report.interrupted:
            for output in outputs:
                output.close(complete=True)
    except GaitSegmentationError as error:
        report.error = str(error)
    except OSError as error:
        report.error = problem_of(error)
    finally:
        for output in outputs:
            output.close(complete=False)
            if report.frames == 0:
                remove(output.work)
        report.left = [output.work for output in outputs if output.work.exists()]
    return report


def replay_all(jobs: list[Job], at_a_time: int, *, force: bool, cluster: str = '') -> list[Report]:
    """
    Replay inputs until all are done, or a signal to end comes.

    :param jobs: at least one; all have the same configuration and bank.
    :param at_a_time: how many are worked on at a time: in this process if it is one.
    :param force: make all outputs again.
    :param cluster: address of a Dask scheduler whose workers do it instead.
    :returns: how those went that were begun.
    :raises BankError: if the bank cannot be read.
    :raises ConfigError: if there is no cluster at the address, or it cannot do this.
    """
    bank = open_bank(jobs[0].bank)
    if not cluster:
        # Before signals are only checked between frames; and once for all processes.
        with compiling(lambda text: print(f'gait_replay: {text}', file=sys.stderr)):
            compile_kernels()
    if cluster or min(at_a_time, len(jobs)) > 1:
        return _share_out(jobs, cluster, min(at_a_time, len(jobs)), force)
    reports: list[Report] = []
    with _until_interrupted() as stop:
        for job in jobs:
            reports.append(replay(job, bank, stop.is_set, force=force, shown=True))
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
    """Give an event that Ctrl-C or SIGTERM sets; the next one interrupts."""
    stop = threading.Event()

    def handle(number: int, _frame: Any) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    before = {each: signal.signal(each, handle) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _share_out(jobs: list[Job], address: str, workers: int, force: bool) -> list[Report]:
    """Have the Dask cluster at an address, or without one processes, replay inputs."""
    from distributed import Client, Event

    bar = _bar(total=len(jobs), unit='input')
    # What matters of its tracebacks is said in a line.
    logging.disable(logging.CRITICAL)
    try:
        with _client(Client, address, workers) as client, _until_interrupted() as stop, bar:
            halt = Event(client=client)
            futures = {
                client.submit(_replay_task, job, halt, force, pure=False): job for job in jobs
            }
            reports: list[Report] = []
            while futures:
                if stop.is_set():
                    halt.set()
                time.sleep(_ASK_S)
                for future in [each for each in futures if each.done()]:
                    job = futures.pop(future)
                    try:
                        reports += future.result()
                    except Exception as error:
                        # Of Dask: the worker died, as when memory runs out, or the cluster.
                        why = f'{type(error).__name__}: {error}'.partition('. ')[0]
                        said = f'a worker failed, the same command goes on ({why})'
                        reports.append(Report(job.input, error=said))
                    bar.update()
            return reports
    except Exception as error:
        option = f'--dask {address}' if address else '--jobs'
        raise ConfigError(f'{option}: {error or type(error).__name__}') from error
    finally:
        logging.disable(logging.NOTSET)


def _client(kind: Any, address: str, workers: int) -> Any:
    """Return a client of the cluster at an address, or without one of processes of its own."""
    if address:
        client = kind(address, timeout=_CONNECT_S, set_as_default=False)
        client.wait_for_workers(1, timeout=_CONNECT_S)
        # Where this package is not, tasks wait without a word.
        client.run_on_scheduler(import_module, __name__)
        client.run(import_module, __name__)
        return client
    # As processes inherit it: Ctrl-C reaches all, and this one alone decides.
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        # What kills a worker, such as a lack of memory, is likely to kill the next one.
        return kind(
            n_workers=workers, threads_per_worker=1, memory_limit=None, dashboard_address=':0',
            silence_logs=logging.CRITICAL, set_as_default=False,
            scheduler_kwargs={'allowed_failures': 0},
        )  # fmt: skip
    finally:
        signal.signal(signal.SIGINT, before)


def _replay_task(job: Job, halt: Any, force: bool) -> list[Report]:
    """Replay an input in a worker, unless it is to begin nothing more."""
    if halt.is_set():
        return []
    due = 0.0

    def stop() -> bool:
        nonlocal due
        if time.monotonic() < due:
            return False
        due = time.monotonic() + _ASK_S
        return bool(halt.is_set())

    return [replay(job, _prepared(job.bank), stop, force=force)]


@cache
def _prepared(bank: str) -> TemplateBank:
    """Open a bank, once in a process, and compile the kernels if that was not done."""
    compile_kernels()
    return open_bank(bank)
