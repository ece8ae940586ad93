# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips to draw figures of, and what the pipeline makes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import replaced
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import open_input
from gait_segmentation.results import MatchResult, TrackResult
from gait_tools.evaluation.sequence import Sequence

if TYPE_CHECKING:
    # Which takes long to load.
    from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig

__all__ = ['Given', 'Shot', 'Walk', 'figured', 'open_walk', 'record']


class Given(NamedTuple):
    """
    A frame of a clip.

    ``image`` is (H, W, 3) uint8 BGR, ``truth`` (H, W) uint8 as in a sequence folder, None without;
    ``phase`` is the true one in [0, 1), None if nobody knows.
    """

    number: int
    stamp_ns: int
    image: NDArray[np.uint8]
    truth: NDArray[np.uint8] | None
    phase: float | None


@dataclass(frozen=True)
class Walk:
    """
    A clip of one person: its name, the box in the first frame, and its frames.

    ``frames`` reads them anew each time.
    """

    name: str
    box: Box
    frames: Callable[[], Iterator[Given]]


@dataclass(frozen=True)
class Shot:
    """A frame, and what the stages found of the person; ``mask`` is uint8 0/255."""

    given: Given
    track: TrackResult
    match: MatchResult
    mask: NDArray[np.uint8]


def open_walk(path: Path, box: Box | None) -> Walk:
    """
    Open a clip.

    :param path: a sequence folder, or a film, a folder of images or a bag.
    :param box: tight about the person in the first frame, in pixels; None takes that of the
        sequence folder.
    :raises SequenceError: if it cannot be read or has no box.
    """
    if (path / 'sequence.yaml').exists():
        return _sequence(Sequence.load(path), box)
    if box is None:
        raise SequenceError(f'{path} has no sequence.yaml with an initial_box: --box is needed')
    open_input(path)
    return Walk(path.stem, box, lambda: _filmed(path))


def _sequence(sequence: Sequence, box: Box | None) -> Walk:
    box = box or sequence.initial_box
    if box is None:
        raise SequenceError(f'{sequence.folder} has no initial_box: --box is needed')
    phases = _phases(sequence)

    def frames() -> Iterator[Given]:
        for number in sequence.numbers:
            image, truth = sequence.image(number), sequence.truth(number)
            yield Given(number, sequence.stamp_ns(number), image, truth, phases.get(number))

    return Walk(sequence.name, box, frames)


def _phases(sequence: Sequence) -> dict[int, float]:
    """
    Return the true phases by frame number, none if ``sequence.yaml`` does not say them.

    :raises SequenceError: if they are no numbers, or not as many as frames.
    """
    path, values = sequence.folder / 'sequence.yaml', sequence.about.get('phases')
    if values is None:
        return {}
    numbers = isinstance(values, list) and all(isinstance(each, (int, float)) for each in values)
    if not numbers or len(values) != len(sequence.frames):
        raise SequenceError(
            f'phases in {path} must be {len(sequence.frames)} numbers, one for each frame'
        )
    return {
        number: float(each) % 1.0 for number, each in zip(sequence.frames, values, strict=True)
    }


def _filmed(path: Path) -> Iterator[Given]:
    for frame in open_input(path).frames():
        if frame.image is not None:
            yield Given(frame.number, frame.stamp_ns, frame.image, None, None)


def figured(config: PipelineConfig) -> PipelineConfig:
    """Return a configuration that tracks nobody but the one whose box is given."""
    config = replaced(config, 'starting', 'auto_init', 'none')
    return replaced(config, 'people', 'max_people', 1)


def record(pipeline: Pipeline, walk: Walk) -> list[Shot]:
    """
    Give a clip to a pipeline of one slot and keep what comes back of the person.

    Frames in which nobody is tracked are kept, too.
    """
    waiting: dict[int, Given] = {}
    shots: list[Shot] = []

    def keep(results: Iterable[FrameResult]) -> None:
        for result in results:
            person: Any = result.people[0]
            given = waiting.pop(result.stamp_ns)
            shots.append(Shot(given, person.track, person.match, person.segmentation.mask))

    pipeline.initialize(walk.box)
    for given in walk.frames():
        waiting[given.stamp_ns] = given
        keep(pipeline.update(given.image, given.stamp_ns))
    keep(pipeline.flush())
    if not any(shot.match.body is not None for shot in shots):
        raise SequenceError(f'{walk.name}: nobody was tracked from the box {walk.box}')
    return shots
