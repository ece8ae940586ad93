# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One input through the pipeline in lockstep, every frame, into its outputs."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from gait_segmentation.cli.replaying.ahead import ahead
from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.file_outputs import CsvOutput, MasksOutput, OverlayOutput
from gait_segmentation.cli.replaying.opengait import OpenGaitOutput
from gait_segmentation.cli.replaying.output import Output, Replayed, partial_path
from gait_segmentation.errors import ConfigError, GaitSegmentationError, InputError
from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.inputs import DamagedError, Frame, ImageSource, open_input
from gait_segmentation.pipeline import FrameResult, PersonResult, Pipeline, PipelineConfig
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
from gait_segmentation.ros.intake import Intake

__all__ = ['Job', 'Report', 'Stop', 'replay', 'results_of']


_MOST_NOTES = 10


class Stop(Protocol):
    """Says whether to break off."""

    def is_set(self) -> bool:
        """Return whether to break off."""


@dataclass(frozen=True)
class Job:
    """
    An input, how to run it, and where its outputs go (None: not wanted).

    ``box`` is in pixels of the input.
    """

    input: Path
    config: PipelineConfig
    bag: Path
    bank: str = ''
    topic: str = ''
    width: int = 0
    start: int = 0
    count: int | None = None
    box: Box | None = None
    masks: Path | None = None
    overlay: Path | None = None
    opengait: Path | None = None
    csv: Path | None = None
    threads: int = 1

    @property
    def finished(self) -> bool:
        """Return whether all outputs are there."""
        return not self.missing()

    def missing(self, *, force: bool = False) -> dict[type[Output], Path]:
        """Return the outputs that are wanted and not there, or with ``force`` all wanted."""
        wanted: dict[type[Output], Path | None] = {
            BagOutput: self.bag,
            MasksOutput: self.masks,
            OverlayOutput: self.overlay,
            OpenGaitOutput: self.opengait,
            CsvOutput: self.csv,
        }
        return {
            kind: path
            for kind, path in wanted.items()
            if path is not None and (force or not kind.is_there(path))
        }

    def source(self) -> ImageSource:
        """Open the input."""
        return open_input(
            self.input, topic=self.topic, width=self.width, start=self.start, count=self.count
        )


@dataclass
class Report:
    """
    How a replay went.

    ``error`` says why it ended before its time, ``damaged`` where the input breaks off, ``left``
    which outputs were left incomplete, and ``notes`` what else there is to know; ``unsaid``
    counts the notes that were not kept.
    """

    input: Path
    frames: int = 0
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


def results_of(
    source: ImageSource,
    pipeline: Pipeline,
    box: Box | None,
    warn: Callable[[str], None],
) -> Iterator[Replayed]:
    """
    Run every frame through a pipeline.

    A frame that cannot be read or used has a result in which nobody is seen, as from the nodes.

    :param box: of the person in the first frame, in pixels of the frames.
    :param warn: told what is worth a warning.
    :raises DamagedError: where the input breaks off, after all results of the frames before.
    """
    slots = pipeline.config.people.max_people
    likelihood_shape = (0, 0)
    # Frames whose results are not there yet, and whether there will be one.
    waiting: deque[tuple[Frame, bool]] = deque()

    def blank(frame: Frame) -> Replayed:
        return Replayed(frame, _blank(frame, slots, likelihood_shape))

    def complete(results: list[FrameResult]) -> Iterator[Replayed]:
        nonlocal likelihood_shape
        for result in results:
            while True:
                frame, usable = waiting.popleft()
                if usable and frame.stamp_ns == result.stamp_ns:
                    break
                yield blank(frame)
            likelihood = result.people[0].track.likelihood
            likelihood_shape = (likelihood.shape[0], likelihood.shape[1])
            yield Replayed(frame, result)
        while waiting and not waiting[0][1]:
            yield blank(waiting.popleft()[0])

    flushed: list[Replayed] = []

    def start_over() -> None:
        flushed.extend(complete(pipeline.flush()))
        flushed.extend(blank(frame) for frame, _ in waiting)
        waiting.clear()
        pipeline.reset()

    intake = Intake(
        reset=start_over,
        initialize=pipeline.initialize,
        warn=lambda _, text: warn(text),
        initial_box=box,
    )
    damage: DamagedError | None = None
    frames = ahead(source.frames())
    while True:
        try:
            frame = next(frames, None)
        except DamagedError as error:
            damage, frame = error, None
        if frame is None:
            break
        if frame.image is None:
            warn(f'frame {frame.number} cannot be read: {frame.problem}')
            waiting.append((frame, False))
            yield from complete([])
            continue
        intake.take(frame.image, frame.stamp_ns)
        yield from flushed
        flushed.clear()
        try:
            results = pipeline.update(frame.image, frame.stamp_ns)
        except InputError as error:
            warn(f'frame {frame.number} cannot be used: {error}')
            waiting.append((frame, False))
            yield from complete([])
            continue
        waiting.append((frame, True))
        yield from complete(results)
    start_over()
    yield from flushed
    if damage is not None:
        raise damage


def _blank(frame: Frame, slots: int, likelihood_shape: tuple[int, int]) -> FrameResult:
    """Return that nobody is seen."""
    dark = np.zeros(likelihood_shape, np.uint8)
    mask = np.zeros(frame.shape, np.uint8)
    stamp_ns = frame.stamp_ns
    person = PersonResult(
        TrackResult(stamp_ns, 0, None, dark, 0.0),
        MatchResult(stamp_ns, 0, None, None, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, dark),
        SegmentationResult(stamp_ns, 0, mask, frame.problem),
    )
    return FrameResult(stamp_ns, (person,) * slots, mask, mask, {})


def replay(
    job: Job,
    bank: TemplateBank,
    stop: Stop,
    *,
    force: bool = False,
    progress: Callable[[], None] = lambda: None,
) -> Report:
    """
    Replay an input into those of its outputs that are not there yet.

    :param stop: looked at after every frame.
    :param force: make all outputs anew.
    :param progress: called after every frame.
    :returns: how it went; errors of the input and of writing are reported, not raised.
    """
    report = Report(job.input)
    outputs: list[Output] = []
    complete = False
    try:
        cv2.setNumThreads(job.threads)
        source = job.source()
        box = _scaled_box(job, source)
        for output in _outputs(job, source, bank, force):
            outputs.append(output)
        results = results_of(source, Pipeline(job.config, bank), box, report.note)
        with closing(ahead(results)) as found:
            complete = _run(report, outputs, found, stop, progress)
        for output in outputs:
            output.close(complete=complete)
    except GaitSegmentationError as error:
        complete, report.error = False, str(error)
    except OSError as error:
        where = f' {error.filename}' if error.filename else ''
        complete, report.error = False, f'cannot write{where}: {error.strerror or error}'
    except BaseException:
        complete = False
        raise
    finally:
        if not complete:
            for output in outputs:
                output.close(complete=False)
            left = [partial_path(output.path) for output in outputs]
            report.left = [path for path in left if path.exists()]
    return report


def _run(
    report: Report,
    outputs: list[Output],
    results: Iterator[Replayed],
    stop: Stop,
    progress: Callable[[], None],
) -> bool:
    """Feed the outputs and return whether the end was reached."""
    try:
        for replayed in results:
            for output in outputs:
                output.add(replayed)
            report.frames += 1
            progress()
            if stop.is_set():
                report.interrupted = True
                return False
    except DamagedError as error:
        report.damaged = str(error)
    return True


def _scaled_box(job: Job, source: ImageSource) -> Box | None:
    """
    Return the first box in the pixels of the frames.

    :raises ConfigError: if it lies outside of them or is far larger.
    """
    if job.box is None:
        return None
    box = job.box.scaled(source.scale)
    try:
        check_start_box(box, source.size)
    except InputError as error:
        raise ConfigError(f'the first box does not fit the frames: {error}') from error
    return box


def _outputs(job: Job, source: ImageSource, bank: TemplateBank, force: bool) -> Iterator[Output]:
    """Begin the outputs that are wanted and not there yet."""
    missing = job.missing(force=force)
    if BagOutput in missing:
        yield BagOutput(missing[BagOutput], bank, job.config.people.max_people)
    if MasksOutput in missing:
        yield MasksOutput(missing[MasksOutput])
    if OverlayOutput in missing:
        yield OverlayOutput(missing[OverlayOutput], source.size, source.fps)
    if OpenGaitOutput in missing:
        yield OpenGaitOutput(missing[OpenGaitOutput])
    if CsvOutput in missing:
        yield CsvOutput(missing[CsvOutput])
