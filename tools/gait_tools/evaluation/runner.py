# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a pipeline over a sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.results import TRACKED
from gait_segmentation.stamps import HeldFrames
from gait_tools.evaluation.metrics import FrameScore, jaccard, score_frame
from gait_tools.evaluation.sequence import Sequence

if TYPE_CHECKING:  # which takes long to load
    from gait_segmentation.pipeline import FrameResult, PersonResult, Pipeline


@dataclass(frozen=True)
class Outcome:
    """
    What the pipeline made of one frame, in the slot of greatest J (the first without truth).

    ``seconds`` took the call that took the frame in; ``people`` are all slots that see somebody.
    """

    number: int
    mask: NDArray[np.uint8]
    box: Box | None
    timings_ms: dict[str, float]
    seconds: float
    score: FrameScore | None
    people: tuple[PersonResult, ...] = ()


def run(
    pipeline: Pipeline,
    sequence: Sequence,
    numbers: Iterable[int],
    starts: Mapping[int, Iterable[Box]],
    *,
    clock: Callable[[], float],
    heat_map: Callable[[int], HeatMap | None] | None = None,
) -> Iterator[Outcome]:
    """Score what a pipeline makes of frames and first boxes (by frame), in their order."""
    held: HeldFrames[tuple[int, tuple[int, ...], float]] = HeldFrames()
    for number in numbers:
        for start in starts.get(number, ()):
            pipeline.initialize(start)
        image = sequence.image(number)
        stamp = sequence.stamp_ns(number)
        heat = None if heat_map is None else heat_map(number)
        started = clock()
        if heat is not None:
            pipeline.add_heat_map(heat.values, heat.stamp_ns)
        results = pipeline.update(image, stamp)
        held.hold(stamp, (number, image.shape[:2], clock() - started))
        for frame, result in held.answered(results):
            yield _outcome(sequence, *frame, result)
    for frame, result in held.answered(pipeline.flush(), last=True):
        yield _outcome(sequence, *frame, result)


def _outcome(
    sequence: Sequence,
    number: int,
    shape: tuple[int, ...],
    seconds: float,
    result: FrameResult | None,
) -> Outcome:
    truth = sequence.truth(number)
    if result is None:
        mask = np.zeros(shape, np.uint8)
        score = None if truth is None else score_frame(mask, None, truth)
        return Outcome(number, mask, None, {}, seconds, score)
    person = result.people[0]
    if truth is not None and len(result.people) > 1:
        person = max(result.people, key=lambda each: jaccard(each.segmentation.mask, truth))
    mask, track, match = person.segmentation.mask, person.track, person.match
    seen = (each for each in result.people if each.track.state == TRACKED)
    people = tuple(each for each in seen if each.track.box is not None)
    score = None
    if truth is not None:
        score = score_frame(mask, track.box, truth, track.body, match.box, match.placed)
    return Outcome(number, mask, track.box, result.timings_ms, seconds, score, people)
