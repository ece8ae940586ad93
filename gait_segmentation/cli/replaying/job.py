# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a replay is to do with an input, and how that went."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.file_outputs import CsvOutput, MasksOutput, OverlayOutput
from gait_segmentation.cli.replaying.opengait import OpenGaitOutput
from gait_segmentation.cli.replaying.output import Output
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.pipeline import PipelineConfig
from gait_segmentation.pixel_limit import MOST_PIXELS

__all__ = ['Job', 'Report']

_MOST_NOTES = 10


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

    def check(self, *, force: bool) -> None:
        """
        Look at the places of the outputs that are to be made.

        :param force: all wanted ones are.
        :raises SequenceError: if one is taken by something else.
        """
        for kind, path in self.missing(force=force).items():
            kind.check(path)

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
