# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One evaluation: several sequences, one configuration, one report."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence as ListLike
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import cv2
import numpy as np
from tqdm import tqdm

from gait_segmentation.config import replaced
from gait_segmentation.errors import SequenceError
from gait_tools.evaluation.metrics import PERSON, evaluation_window, jaccard, mean_known, start_box
from gait_tools.evaluation.report import SequenceOutput, Summary, mean_of
from gait_tools.evaluation.runner import Outcome, run
from gait_tools.evaluation.sequence import Boxes, Sequence, named_apart, read_mask
from gait_tools.evaluation.tracking_score import TrackingScore, first_frames

if TYPE_CHECKING:  # which takes long to load
    from gait_segmentation.pipeline import Pipeline

Item = TypeVar('Item')
# Frames between warm starts, in what is scored of one, and that must follow for it to count.
WARM_EVERY, WARM_FRAMES, WARM_LEAST = 10, 14, 5
MAP_SLOTS = 3  # slots, at least, where nobody is given but heat maps show everybody at once


def load_sequences(folders: Iterable[Path], heat_map: str = '') -> list[Sequence]:
    """Open sequences to be scored, with heat maps where these are named."""
    loaded = []
    for folder in folders:
        sequence = Sequence.load(folder)
        scored = [number for number in sequence.numbers if number in sequence.masks]
        if not scored:
            raise SequenceError(
                f'{folder / "masks"} has no mask of a frame from {sequence.initial_frame} on, so '
                'there is nothing to score'
            )
        if not any(PERSON in read_mask(sequence.masks[n], sequence.size) for n in scored):
            raise SequenceError(
                f'no mask in {folder / "masks"} has a pixel of {PERSON}, the value of a person'
            )
        sequence.heat_maps(heat_map)
        loaded.append(sequence)
    return named_apart(loaded)


def map_j(sequence: Sequence, name: str) -> float | None:
    """Return J of the heat maps alone, above one half; of frames without one it is 0."""
    read, scores = sequence.heat_maps(name.partition(':')[0]), []
    for number in sequence.numbers:
        truth, heat = sequence.truth(number), read and read(number)
        if truth is not None:
            mask = np.zeros_like(truth)
            if heat is not None:
                mask = cv2.resize(heat.values, truth.shape[::-1]) // 128
            window = evaluation_window(truth)
            scores.append(jaccard(mask[window], truth[window]))
    return mean_known(scores)


@dataclass(frozen=True)
class Session:
    """
    What stays the same while configurations are compared.

    With ``auto`` pipelines find people by themselves; without it they only track who is given.
    ``fixed`` are the parameters (``stage.name``) that are not changed for the number of people.
    """

    sequences: ListLike[Sequence]
    make_pipeline: Callable[[Any], Pipeline]
    clock: Callable[[], float]
    warm: bool = False
    heat_map: str = ''
    auto: bool = False
    fixed: frozenset[str] = frozenset()

    def evaluate(self, config: Any, out: Path | None = None, name: str = '') -> dict[str, Any]:
        """Run a configuration over all: ``sequences``, ``mean``, and ``warm`` if asked for."""
        rows: dict[str, Any] = {}
        warm: dict[str, dict[str, float | None]] = {}
        for sequence in self.sequences:
            title = f'{name} {sequence.name}'.strip()
            summary = self.score(config, sequence, sequence.starts, out, title)
            rows[sequence.name] = summary.numbers()
            if self.heat_map:
                rows[sequence.name]['map_J'] = map_j(sequence, self.heat_map)
            if self.warm:
                starts = list(self._warm_starts(config, sequence))
                mean_j = mean_known(map(statistics.fmean, starts))
                warm[sequence.name] = {'J': mean_j, 'J0': mean_known(js[0] for js in starts)}
        report: dict[str, Any] = {'sequences': rows, 'mean': mean_of(rows.values())}
        if self.warm:
            means = {key: mean_known(row[key] for row in warm.values()) for key in ('J', 'J0')}
            report['warm'] = {**means, 'per_sequence': warm}
        return report

    def _run(
        self, config: Any, sequence: Sequence, numbers: Iterable[int], starts: Boxes
    ) -> Iterator[Outcome]:
        """Run a pipeline that has seen nothing over frames of a sequence."""
        return run(
            self.make_pipeline(config),
            sequence,
            numbers,
            starts,
            clock=self.clock,
            heat_map=sequence.heat_maps(self.heat_map),
        )

    def score(
        self,
        config: Any,
        sequence: Sequence,
        starts: Boxes,
        out: Path | None = None,
        title: str = '',
    ) -> Summary:
        """Score a sequence started from boxes; a title shows a bar, ``out`` gets pictures."""
        attendance, starts = sequence.attendance, {} if self.auto else starts
        slots = len(attendance.people) if sequence.label_files else 0
        if self.auto and self.heat_map:
            slots = max(slots, MAP_SLOTS)
        config = self._suited(config, slots)
        summary = Summary(TrackingScore(attendance, first_frames(attendance, starts)))
        output = None if out is None else SequenceOutput(out / sequence.name, sequence)
        outcomes = self._run(config, sequence, sequence.numbers, starts)
        for outcome in shown(outcomes, title, len(sequence.numbers)):
            summary.add(outcome, sequence.labels(outcome.number))
            if output is not None:
                output.add(outcome)
        if output is not None:
            output.close()
        return summary

    def _warm_starts(self, config: Any, sequence: Sequence) -> Iterator[list[float]]:
        """Give the true box at every tenth frame that shows a person; yield J from there on."""
        single, numbers = self._suited(config, 1), sequence.numbers
        places = range(0, len(numbers) - WARM_LEAST, WARM_EVERY)
        for place in shown(places, f'{sequence.name} warm', len(places)):
            first = numbers[place]
            truth = sequence.truth(first)
            box = None if truth is None else start_box(truth)
            if box is not None:
                seen = [each for each in sequence.frames if each < first]
                seen += numbers[place : place + WARM_FRAMES]
                outcomes = self._run(single, sequence, seen, {first: (box,)})
                scored = [each.score for each in outcomes if each.number >= first]
                yield [score.j for score in scored if score is not None]

    def _suited(self, config: Any, slots: int) -> Any:
        """Return a configuration with a number of slots (0 as it is)."""
        if slots > 0 and 'people.max_people' not in self.fixed:
            config = replaced(config, 'people', 'max_people', slots)
        return config


def shown(items: Iterable[Item], name: str, total: int) -> Iterator[Item]:
    """Pass items on, and show how many there were."""
    # disable=None: no bar where stderr is not a terminal.
    off = None if name else True
    yield from tqdm(items, name, total, unit='frame', disable=off, leave=False)
