# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The restart score: a pipeline over many short stretches of a sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gait_segmentation.evaluation.metrics import start_box
from gait_segmentation.evaluation.runner import (
    Clip,
    Runnable,
    heat_maps_of,
    likelihoods_of,
    run,
)
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.geometry import Box

__all__ = ['StartScore', 'restarts_of', 'run_restarts']

RESTART_EVERY = 10
"""Frames between the starts of the restart score."""

RESTART_FRAMES = 14
"""Length of the runs of the restart score."""

RESTART_LEAST = 5
"""Frames that must follow a start for it to count."""


@dataclass(frozen=True)
class StartScore:
    """One run of the restart score: its first frame, mean J and J of the first frame."""

    number: int
    j: float
    j0: float


def restarts_of(clip: Clip) -> list[tuple[list[int], Box]]:
    """
    Return the stretches of the restart score: their frames, and the box in the first.

    They are 14 frames long, from every tenth frame on that has a person in its truth and at least
    five frames to follow.
    """
    numbers = clip.numbers
    found = []
    for place in range(0, len(numbers) - RESTART_LEAST, RESTART_EVERY):
        truth = clip.truth(numbers[place])
        box = None if truth is None else start_box(truth)
        if box is not None:
            found.append((numbers[place : place + RESTART_FRAMES], box))
    return found


def run_restarts(
    make_pipeline: Callable[[], Runnable],
    sequence: Sequence,
    *,
    clock: Callable[[], float],
    likelihood_name: str = '',
    heat_map_name: str = '',
    warm: bool = False,
) -> Iterator[StartScore]:
    """
    Start anew from the true box (with its ambiguous rim) at every tenth frame, for 14 frames.

    :param make_pipeline: makes a pipeline that has seen nothing.
    :param likelihood_name: see :func:`run_sequence`; ``heat_map_name`` likewise.
    :param warm: whether the pipeline sees the frames before as well, from the clip's first one.
    """
    likelihood = likelihoods_of(sequence, likelihood_name)
    for numbers, box in restarts_of(sequence):
        first = numbers[0]
        before = [number for number in sorted(sequence.frames) if number < first] if warm else []
        outcomes = run(
            make_pipeline(),
            sequence,
            [*before, *numbers],
            {first: (box,)},
            clock=clock,
            likelihood=likelihood,
            heat_map=heat_maps_of(sequence, heat_map_name),
        )
        scores = [
            outcome.score.j
            for outcome in outcomes
            if outcome.number >= first and outcome.score is not None
        ]
        yield StartScore(first, float(np.mean(scores)), scores[0])
