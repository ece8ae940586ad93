# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips to draw figures of, what the pipeline makes of them, and how far off that is."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence as ListLike
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import replaced
from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.results import MatchResult, TrackResult
from gait_tools.evaluation.metrics import error_percent, evaluation_window, jaccard
from gait_tools.evaluation.sequence import Sequence

if TYPE_CHECKING:  # which takes long to load
    from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig


class Given(NamedTuple):
    """A frame of a clip, its true mask (None without) and phase in [0, 1) (NaN without)."""

    number: int
    stamp_ns: int
    image: NDArray[np.uint8]
    truth: NDArray[np.uint8] | None
    phase: float


@dataclass(frozen=True)
class Walk:
    """A clip of one person, the box in the first frame, and what reads the frames anew."""

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

    def phase(self, phases: int) -> float:
        """Return the phase of the matched one of so many templates, in strides, NaN without."""
        return math.nan if self.match.body is None else self.match.phase_index / phases

    def error(self) -> float:
        """Return the wrong pixels in percent of the window, NaN without truth."""
        truth = self.given.truth
        if truth is None:
            return math.nan
        window = evaluation_window(truth)
        return error_percent(self.mask[window], truth[window])


def open_walk(path: Path, box: Box | None, **reading: Any) -> Walk:
    """Open a sequence folder, or what :func:`open_input` opens, which needs a box."""
    if (path / 'sequence.yaml').exists():
        if reading:
            raise ConfigError(
                f'{path} is a sequence folder, read as it is: --{next(iter(reading))} is of a film'
            )
        return _sequence(Sequence.load(path), box)
    if box is None:
        raise SequenceError(f'{path} has no sequence.yaml with an initial_box: --box is needed')
    film = open_input(path, **reading)
    return Walk(path.stem, box.scaled(film.scale), lambda: _filmed(film))


def _sequence(sequence: Sequence, box: Box | None) -> Walk:
    box = box or sequence.initial_box
    if box is None:
        raise SequenceError(f'{sequence.folder} has no initial_box: --box is needed')
    phases = _phases(sequence)

    def frames() -> Iterator[Given]:
        for number in sequence.numbers:
            image, truth = sequence.image(number), sequence.truth(number)
            phase = phases.get(number, math.nan)
            yield Given(number, sequence.stamp_ns(number), image, truth, phase)

    return Walk(sequence.name, box, frames)


def _phases(sequence: Sequence) -> dict[int, float]:
    """Return the true phases by frame number, none if ``sequence.yaml`` does not say them."""
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


def _filmed(film: ImageSource) -> Iterator[Given]:
    for frame in film.frames():
        if frame.image is not None:
            yield Given(frame.number, frame.stamp_ns, frame.image, None, math.nan)


def figured(config: PipelineConfig) -> PipelineConfig:
    """Return a configuration that tracks nobody but the one whose box is given."""
    config = replaced(config, 'detector', 'network', 'none')
    return replaced(config, 'people', 'max_people', 1)


def record(pipeline: Pipeline, walk: Walk) -> list[Shot]:
    """Give a clip to a pipeline of one slot; keep all that comes back of the person."""
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


@dataclass(frozen=True)
class Phases:
    """Phases of the best templates alone, of the best path, and the true ones; NaN without."""

    numbers: NDArray[np.int64]
    alone: NDArray[np.float64]
    path: NDArray[np.float64]
    true: NDArray[np.float64]

    def backward(self, phases: NDArray[np.float64]) -> float:
        """Return how many of the steps go back, by up to half a stride, in percent."""
        steps = np.diff(phases)
        steps = steps[np.isfinite(steps)]
        return 100 * float(np.mean((steps + 0.5) % 1.0 - 0.5 < -1e-6)) if len(steps) else 0.0

    def rms(self, phases: NDArray[np.float64]) -> float:
        """Return the error in percent of a stride; half a stride may be off, NaN without truth."""
        off = phases - self.true
        off = off[np.isfinite(off)]
        if not len(off):
            return float('nan')
        halves = [np.sqrt(np.mean(((off + flip + 0.5) % 1.0 - 0.5) ** 2)) for flip in (0.0, 0.5)]
        return 100 * float(min(halves))

    def shown_truth(self) -> NDArray[np.float64]:
        """Return the true phases in the half of the stride that the path has chosen."""
        off = (self.path - self.true + 0.5) % 1.0 - 0.5
        flipped = bool(np.isfinite(off).any()) and np.nanmedian(np.abs(off)) > 0.25
        return np.asarray((self.true + (0.5 if flipped else 0.0)) % 1.0)


def phases_of(shots: ListLike[Shot], bank: TemplateBank, config: MatchingConfig) -> Phases:
    """Match each frame of a walk by itself, too, with the same boxes and likelihoods."""
    matcher, alone = SequenceMatcher(bank, replace(config, lag=0)), []
    for shot in shots:
        track, shape = shot.track, shot.given.image.shape
        matcher.flush()
        (match,) = matcher.add_frame(track, (shape[1], shape[0]))
        alone.append(replace(shot, match=match).phase(bank.phases))
    return Phases(
        np.array([shot.given.number for shot in shots]),
        np.array(alone),
        np.array([shot.phase(bank.phases) for shot in shots]),
        np.array([shot.given.phase for shot in shots]),
    )


def mean_scores(shots: ListLike[Shot]) -> tuple[int, float, float] | None:
    """Return how many frames have truth, their mean error in percent and mean J."""
    errors, js = [], []
    for shot in shots:
        truth = shot.given.truth
        if truth is not None:
            window = evaluation_window(truth)
            errors.append(shot.error())
            js.append(jaccard(shot.mask[window], truth[window]))
    return (len(js), statistics.fmean(errors), statistics.fmean(js)) if js else None
