# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One input, every frame of it, into its outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing

import cv2

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.file_outputs import OverlayOutput
from gait_segmentation.cli.replaying.job import Job, Report
from gait_segmentation.cli.replaying.lockstep import ahead, results_of
from gait_segmentation.cli.replaying.mark import digest_of
from gait_segmentation.cli.replaying.output import Output, Replayed, partial_path, remove
from gait_segmentation.errors import ConfigError, GaitSegmentationError, InputError
from gait_segmentation.files.output_files import problem_of
from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.inputs import DamagedError, ImageSource
from gait_segmentation.inputs.heat_maps import open_heat_maps
from gait_segmentation.pipeline import Pipeline
from gait_segmentation.ros.memory import keep_freed_memory

__all__ = ['replay']


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
        # Dask has its workers return it at once.
        keep_freed_memory()
        source = job.source()
        box = _scaled_box(job, source)
        for output in _outputs(job, source, force):
            outputs.append(output)
        maps = open_heat_maps(job.heat_map, job.input) if job.heat_map else None
        results = results_of(source, Pipeline(job.config, bank), box, report.note, maps)
        with closing(ahead(results)) as found:
            complete = _run(report, outputs, found, stop, progress)
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


def _run(
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


def _outputs(job: Job, source: ImageSource, force: bool) -> Iterator[Output]:
    """Begin the outputs that are wanted and not there yet."""
    for kind, path in job.missing(force=force).items():
        if kind is BagOutput:
            slots = job.config.people.max_people
            yield BagOutput(path, slots, digest_of(job.input))
        elif kind is OverlayOutput:
            yield OverlayOutput(path, source.size, source.fps)
        else:
            yield kind(path)
