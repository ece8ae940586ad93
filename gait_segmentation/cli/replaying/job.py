# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What gait_replay is to do with one input, and how it went."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.mark import digest_of
from gait_segmentation.cli.replaying.output import Output, partial_path
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import keep_apart
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.pipeline import PipelineConfig

__all__ = ['Job', 'Report']

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

    def check(self, inputs: Iterable[Path], *, force: bool) -> None:
        """
        Look at the places of all outputs, before anything is written.

        :param inputs: all that the command reads.
        :param force: outputs that are there are to be made anew.
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
        if force or not BagOutput.is_there(self.bag):
            return
        if BagOutput.digest(self.bag) != digest_of(self.input):
            raise SequenceError(
                f'{self.bag} was made of another input than {self.input}: choose another --out, '
                'or --force replaces it'
            )

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
