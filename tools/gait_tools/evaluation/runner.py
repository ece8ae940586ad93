# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a pipeline over a sequence."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.image_files import read_heat_map
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.results import TRACKED
from gait_segmentation.stamps import HeldFrames
from gait_tools.evaluation.metrics import FrameScore, jaccard, score_frame
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.truth import PERSON, read_mask

if TYPE_CHECKING:
    # Which takes long to load.
    from gait_segmentation.pipeline import PersonResult

__all__ = [
    'Clip',
    'Outcome',
    'Runnable',
    'check_truth',
    'heat_maps_of',
    'likelihoods_of',
    'run',
]

_TIMED = re.compile(r'([^:]+)(?::([0-9]+)(?::([1-9][0-9]*))?)?')
"""Name of heat maps, how many frames late they come, and of which of them there is one."""


class Runnable(Protocol):
    """What an evaluation needs of a pipeline."""

    def initialize(self, box: Box) -> None:
        """Start a track at the next frame."""

    def update(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        likelihood: NDArray[np.uint8] | None = None,
    ) -> list[Any]:
        """Take in a frame, return the results that are complete."""

    def add_heat_map(self, heat_map: NDArray[np.uint8], stamp_ns: int) -> None:
        """Take in the heat map of the frame with a stamp, which may have come."""

    def flush(self) -> list[Any]:
        """Return the results held back."""


class Clip(Protocol):
    """What an evaluation needs of a sequence, on disk or synthetic."""

    @property
    def numbers(self) -> list[int]:
        """Return the frame numbers, ascending."""

    def stamp_ns(self, number: int) -> int:
        """Return the stamp of a frame."""

    def image(self, number: int) -> NDArray[np.uint8]:
        """Return a frame."""

    def truth(self, number: int) -> NDArray[np.uint8] | None:
        """Return the truth of a frame."""


@dataclass(frozen=True)
class Outcome:
    """
    What the pipeline made of one frame.

    ``mask`` is (H, W) uint8 0/255 and ``box`` the tracked box, both in source pixels; ``phase`` is
    NaN if nobody is tracked.  ``timings_ms`` is by stage, ``seconds`` the
    duration of the call that took the frame in.  ``score`` is None without ground truth.

    With several slots these are of the one whose mask has the greatest J, of the first if there
    is no truth; ``people`` are all slots that see somebody.
    """

    number: int
    mask: NDArray[np.uint8]
    box: Box | None
    phase: float
    timings_ms: dict[str, float]
    seconds: float
    score: FrameScore | None
    people: tuple[PersonResult, ...] = ()


def run(
    pipeline: Runnable,
    clip: Clip,
    numbers: Iterable[int],
    box: Box | Mapping[int, Iterable[Box]],
    *,
    clock: Callable[[], float],
    likelihood: Callable[[int], NDArray[np.uint8]] | None = None,
    heat_map: Callable[[int], HeatMap | None] | None = None,
) -> Iterator[Outcome]:
    """
    Give the frames of a clip to a pipeline and score what comes back, frame by frame.

    With a lag outcomes come later than their frames, but in order.  A frame without a result
    counts as an empty mask and no box.

    :param numbers: the frames, ascending.
    :param box: where the person is in the first of them; or frame number -> boxes of people who
        are to be tracked from there on, empty if the pipeline finds people by itself.
    :param clock: seconds, for the durations.
    :param likelihood: makes the likelihood image to use in a frame in place of the tracker's.
    :param heat_map: makes the heat map that comes with a frame, None where there is none.
    """
    numbers = list(numbers)
    starts = {numbers[0]: (box,)} if isinstance(box, Box) else box
    held: HeldFrames[tuple[int, tuple[int, ...], float]] = HeldFrames()
    for number in numbers:
        for start in starts.get(number, ()):
            pipeline.initialize(start)
        image = clip.image(number)
        stamp = clip.stamp_ns(number)
        given = None if likelihood is None else likelihood(number)
        heat = None if heat_map is None else heat_map(number)
        started = clock()
        if heat is not None:
            pipeline.add_heat_map(heat.values, heat.stamp_ns)
        results = pipeline.update(image, stamp, given)
        held.hold(stamp, (number, image.shape[:2], clock() - started))
        for frame, result in held.answered(results):
            yield _outcome(clip, *frame, result)
    for frame, result in held.answered(pipeline.flush(), last=True):
        yield _outcome(clip, *frame, result)


def _outcome(
    clip: Clip, number: int, shape: tuple[int, ...], seconds: float, result: Any
) -> Outcome:
    mask = np.zeros(shape, np.uint8)
    box = body = matched = None
    phase = math.nan
    timings: dict[str, float] = {}
    people: tuple[PersonResult, ...] = ()
    truth = clip.truth(number)
    if result is not None:
        person = _person_of(result.people, truth)
        mask, box, timings = person.segmentation.mask, person.track.box, result.timings_ms
        body, matched = person.track.body, person.match.box
        if person.match.body is not None:
            phase = person.match.phase
        people = tuple(
            each
            for each in result.people
            if each.track.state == TRACKED and each.track.box is not None
        )
    score = None if truth is None else score_frame(mask, box, truth, body, matched)
    return Outcome(number, mask, box, phase, timings, seconds, score, people)


def _person_of(people: Any, truth: NDArray[np.uint8] | None) -> Any:
    """Return the slot that is scored against the truth of one person."""
    if len(people) == 1 or truth is None:
        return people[0]
    return max(people, key=lambda person: jaccard(person.segmentation.mask, truth))


def check_truth(sequence: Sequence) -> None:
    """
    Refuse a sequence that cannot be scored.

    :raises SequenceError: if no frame from the first box on has a mask with a person in it.
    """
    folder = sequence.folder / 'masks'
    scored = [number for number in sequence.numbers if number in sequence.masks]
    if not scored:
        raise SequenceError(
            f'{folder} has no mask of a frame from {sequence.initial_frame} on, so there is '
            'nothing to score'
        )
    if not any((read_mask(sequence.masks[n], sequence.size) == PERSON).any() for n in scored):
        raise SequenceError(f'no mask in {folder} has a pixel of {PERSON}, the value of a person')


def likelihoods_of(sequence: Sequence, name: str) -> Callable[[int], NDArray[np.uint8]] | None:
    """
    Return what reads the likelihood image of a frame, None for an empty name.

    :param name: of the folder beside ``frames``.
    :raises SequenceError: if there is no such folder.
    """
    if not name:
        return None
    folder: Path = sequence.folder / name
    if not folder.is_dir():
        raise SequenceError(f'{folder} is missing, no likelihood images to read')
    return lambda number: read_mask(folder / f'{sequence.frames[number].stem}.png', sequence.size)


def heat_maps_of(sequence: Sequence, name: str) -> Callable[[int], HeatMap | None] | None:
    """
    Return what reads the heat map that comes with a frame, None for an empty name.

    :param name: of the folder beside ``frames``; with ``NAME:3`` maps come three frames after
        their own, with ``NAME:3:2`` besides with every second frame only.
    :raises SequenceError: if there is no such folder, no map of any frame in it, or these are no
        such numbers.
    """
    if not name:
        return None
    called = _TIMED.fullmatch(name)
    if called is None:
        raise SequenceError(f'heat maps must be NAME, NAME:LATE or NAME:LATE:EVERY, got {name}')
    folder, late, every = sequence.folder / called[1], int(called[2] or 0), int(called[3] or 1)
    if not folder.is_dir():
        raise SequenceError(f'{folder} is missing, no heat maps to read')
    paths = {each: folder / f'{path.stem}.png' for each, path in sequence.frames.items()}
    if not any(path.exists() for path in paths.values()):
        raise SequenceError(f'{folder} has no heat map of a frame, such as {paths[min(paths)]}')
    numbers = sequence.numbers
    own = dict(zip(numbers[late::every], numbers[::every], strict=False))

    def read(number: int) -> HeatMap | None:
        if number not in own or not paths[own[number]].exists():
            return None
        return HeatMap(read_heat_map(paths[own[number]]), sequence.stamp_ns(own[number]))

    return read
