# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The restart score: a pipeline over many short stretches of a sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gait_segmentation.evaluation.metrics import start_box
from gait_segmentation.evaluation.runner import Clip, Runnable, likelihoods_of, run
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.evaluation.truth import PERSON

__all__ = ['RESTART_FRAMES', 'NumberedClip', 'StartScore', 'restart_starts', 'run_restarts']

RESTART_EVERY = 10
"""Frames between the starts of the restart score."""

RESTART_FRAMES = 14
"""Length of the runs of the restart score."""

RESTART_LEAST = 5
"""Frames that must follow a start for it to count."""


class NumberedClip(Clip, Protocol):
    """A sequence that knows its frames."""

    @property
    def numbers(self) -> list[int]:
        """Return the frame numbers, ascending."""


@dataclass(frozen=True)
class StartScore:
    """One run of the restart score: its first frame, mean J and J of the first frame."""

    number: int
    j: float
    j0: float


def restart_starts(sequence: NumberedClip) -> list[int]:
    """Return every tenth frame with a person in its truth and at least five frames to follow."""
    numbers = sequence.numbers
    starts = []
    for place in range(0, len(numbers) - RESTART_LEAST, RESTART_EVERY):
        truth = sequence.truth(numbers[place])
        if truth is not None and (truth == PERSON).any():
            starts.append(numbers[place])
    return starts


def run_restarts(
    make_pipeline: Callable[[], Runnable],
    sequence: Sequence,
    *,
    clock: Callable[[], float],
    likelihood_name: str = '',
) -> Iterator[StartScore]:
    """
    Start anew from the true box (with its ambiguous rim) at every tenth frame, for 14 frames.

    :param make_pipeline: makes a pipeline that has seen nothing.
    :param likelihood_name: see :func:`run_sequence`.
    """
    numbers = sequence.numbers
    likelihood = likelihoods_of(sequence, likelihood_name)
    for start in restart_starts(sequence):
        truth = sequence.truth(start)
        box = None if truth is None else start_box(truth)
        if box is None:
            continue
        place = numbers.index(start)
        stretch = numbers[place : place + RESTART_FRAMES]
        outcomes = run(make_pipeline(), sequence, stretch, box, clock=clock, likelihood=likelihood)
        scores = [outcome.score.j for outcome in outcomes if outcome.score is not None]
        yield StartScore(start, float(np.mean(scores)), scores[0])
