# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Table 1: wrong pixels with and without the shape prior."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gait_segmentation.drawing import Image
from gait_tools.evaluation.metrics import error_percent, evaluation_window, jaccard
from gait_tools.figures.canvas import BLUE, ORANGE, Plot, blank, text
from gait_tools.figures.walk import Shot

__all__ = ['Errors', 'draw_errors', 'errors_of', 'errors_table']

_SIZE = (920, 300)


@dataclass(frozen=True)
class Errors:
    """
    Scores of the frames with truth, by the frame's number.

    ``percent`` are the wrong pixels in percent of the window and ``j`` the intersections over
    union; ambiguous pixels are left out of both.
    """

    percent: dict[int, float]
    j: dict[int, float]

    @property
    def mean(self) -> float:
        """Return the mean error."""
        return statistics.fmean(self.percent.values())

    @property
    def mean_j(self) -> float:
        """Return the mean J."""
        return statistics.fmean(self.j.values())


def errors_of(shots: Sequence[Shot]) -> Errors | None:
    """Score a walk, None if it has no truth."""
    percent, j = {}, {}
    for shot in shots:
        truth = shot.given.truth
        if truth is None:
            continue
        window = evaluation_window(truth)
        percent[shot.given.number] = error_percent(shot.mask[window], truth[window])
        j[shot.given.number] = jaccard(shot.mask[window], truth[window])
    return Errors(percent, j) if percent else None


def errors_table(name: str, without: Errors, with_prior: Errors) -> str:
    """Return the table as Markdown."""
    row = f'| {name} | {len(without.percent)} '
    for each in (without, with_prior):
        row += f'| {each.mean:.2f} % / {each.mean_j:.3f} '
    return (
        '| clip | frames | error / J without the shape prior | with it |\n|---|---|---|---|\n'
        f'{row}|\n'
    )


def draw_errors(without: Errors, with_prior: Errors) -> Image:
    """Draw the errors over the frames, with their means."""
    image = blank(*_SIZE)
    numbers = list(without.percent)
    most = max(*without.percent.values(), *with_prior.percent.values(), 1e-3)
    step = 10 ** np.floor(np.log10(most))
    step *= 1 if most / step > 4 else 0.5 if most / step > 2 else 0.25
    top = float(np.ceil(most / step) * step)
    span = (float(numbers[0]), float(numbers[-1]))
    plot = Plot(image, (60, 64, _SIZE[0] - 20, _SIZE[1] - 46), span, (0, top))
    ticks = np.unique(np.linspace(*span, 8).round())
    plot.axes(ticks, np.arange(0, top + step / 2, step), ('frame', 'wrong pixels, %'))
    for place, (words, each, colour) in enumerate(
        (('without the shape prior', without, ORANGE), ('with it', with_prior, BLUE))
    ):
        plot.line(each.percent.items(), colour)
        plot.dots(each.percent.items(), colour, 3)
        mean = f'{words}: mean {each.mean:.2f} %, J {each.mean_j:.3f}'
        text(image, mean, (60 + 430 * place, 22), colour)
    return image
