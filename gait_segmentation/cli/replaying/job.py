# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a replay is to do with an input, and how that went."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.file_outputs import CsvOutput, MasksOutput, OverlayOutput
from gait_segmentation.cli.replaying.mark import digest_of
from gait_segmentation.cli.replaying.opengait import OpenGaitOutput
from gait_segmentation.cli.replaying.output import Output, partial_path
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import keep_apart
from gait_segmentation.files.pixel_limit import MOST_PIXELS
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.pipeline import PipelineConfig

__all__ = ['Job', 'Report']

_MOST_NOTES = 10

_OPTIONS: dict[type[Output], str] = {
    BagOutput: '--out',
    MasksOutput: '--masks',
    OverlayOutput: '--overlay',
    OpenGaitOutput: '--opengait',
    CsvOutput: '--csv',
}


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
    rate: float = 0.0
    max_pixels: int = MOST_PIXELS
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

    def check(self, inputs: Iterable[Path], *, force: bool) -> None:
        """
        Look at the places of all outputs, before anything is written.

        :param inputs: all that the command reads.
        :param force: outputs that are there are to be made anew.
        :raises ConfigError: if one would change an input.
        :raises SequenceError: if a place is taken by something else.
        """
        wanted = self.missing(force=True)
        places = [
            (_OPTIONS[kind], place)
            for kind, path in wanted.items()
            for place in (path, partial_path(path))
        ]
        keep_apart(places, inputs)
        for kind, path in wanted.items():
            kind.check(path)
        if force or not BagOutput.is_there(self.bag):
            return
        if BagOutput.digest(self.bag) != digest_of(self.input):
            raise SequenceError(
                f'{self.bag} was made of another input than {self.input}: choose another --out, '
                'or --force replaces it'
            )

    def source(self) -> ImageSource:
        """Open the input."""
        return open_input(
            self.input,
            topic=self.topic,
            width=self.width,
            start=self.start,
            count=self.count,
            rate=self.rate,
            max_pixels=self.max_pixels,
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
