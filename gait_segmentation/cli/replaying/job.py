# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One input into its outputs: what is to be done, every frame of it, and how it went."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.file_outputs import CsvOutput, MasksOutput, OverlayOutput
from gait_segmentation.cli.replaying.lockstep import ahead, results_of
from gait_segmentation.cli.replaying.output import About, Output, Replayed, partial_path, remove
from gait_segmentation.cli.replaying.walks import OpenGaitOutput
from gait_segmentation.cli.tool import scaled_box
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.files.encoded_images import MOST_PIXELS
from gait_segmentation.files.output_files import keep_apart, problem_of
from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import DamagedError, ImageSource, open_input
from gait_segmentation.inputs.heat_maps import open_heat_maps
from gait_segmentation.pipeline import Pipeline, PipelineConfig

__all__ = ['OUTPUTS', 'Job', 'Report', 'replay']

OUTPUTS: tuple[type[Output], ...] = (
    BagOutput,
    MasksOutput,
    OverlayOutput,
    CsvOutput,
    OpenGaitOutput,
)
"""What an input can be replayed into; each has an option of the command."""

_MOST_NOTES = 10


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
    threads: int = 1
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
        Look at the places of all outputs, before anything is written.

        :param inputs: all that the command reads.
        :raises ConfigError: if one would change an input.
        :raises SequenceError: if a place is taken by something else.
        """
        places = [
            (kind.option, place)
            for kind, path in self.outputs.items()
            for place in (path, partial_path(path))
        ]
        keep_apart(places, inputs)
        for kind, path in self.outputs.items():
            kind.check(path)

    def source(self) -> ImageSource:
        """Open the input."""
        return open_input(self.input, **self.reading)


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
    progress: Callable[[], object] = lambda: None,
) -> Report:
    """
    Replay an input into those of its outputs that are not there yet.

    :param stop: says whether to break off, asked after every frame.
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
        box = scaled_box(job.box, source)
        about = About(source.size, source.fps, job.config.people.max_people)
        for kind, path in job.missing(force=force).items():
            outputs.append(kind(path, about))
        most = job.reading.get('max_pixels', MOST_PIXELS)
        maps = open_heat_maps(job.heat_map, job.input, most) if job.heat_map else None
        results = results_of(source, Pipeline(job.config, bank), box, report.note, maps)
        with closing(ahead(results)) as found:
            complete = _feed(report, outputs, found, stop, progress)
        for output in outputs:
            output.close(complete=complete)
    except GaitSegmentationError as error:
        complete, report.error = False, str(error)
    except OSError as error:
        complete, report.error = False, problem_of(error)
    except BaseException:
        complete = False
        raise
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


def _feed(
    report: Report,
    outputs: list[Output],
    results: Iterator[Replayed],
    stop: Callable[[], bool],
    progress: Callable[[], object],
) -> bool:
    """Feed the outputs and return whether the end was reached."""
    try:
        for replayed in results:
            for output in outputs:
                with output.written():
                    output.add(replayed)
            report.frames += 1
            report.seen += any(each.track.box is not None for each in replayed.result.people)
            progress()
            if stop():
                report.interrupted = True
                return False
    except DamagedError as error:
        report.damaged = str(error)
    return True
