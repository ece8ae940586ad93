# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Fig. 4: the phase of each frame alone, and of the best path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import Image
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_tools.figures.canvas import BLUE, GREY, ORANGE, Plot, blank, text
from gait_tools.figures.walk import Shot

__all__ = ['Phases', 'draw_phases', 'phases_of']

_PANEL = (460, 300)


@dataclass(frozen=True)
class Phases:
    """
    Phases of the matched templates over the frames of a walk, in strides, (N,), NaN without.

    ``alone`` are those of the best template of each frame, ``path`` those of the best path, and
    ``true`` the true ones.
    """

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
        """
        Return the error in percent of a stride, NaN if the truth is not known.

        Half a stride may be off for the whole clip: in profile both halves look alike.
        """
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


def phases_of(shots: Sequence[Shot], bank: TemplateBank, config: MatchingConfig) -> Phases:
    """
    Match each frame of a walk by itself, too, with the same boxes and likelihoods.

    :param shots: of the walk.
    """
    matcher = SequenceMatcher(bank, replace(config, lag=0))
    alone = []
    for shot in shots:
        track, shape = shot.track, shot.given.image.shape
        matcher.reset()
        (match,) = matcher.update(
            track.likelihood,
            track.body,
            track.stamp_ns,
            track_id=track.track_id,
            source_size=(shape[1], shape[0]),
            angle=track.angle,
        )
        alone.append(np.nan if match.body is None else match.phase_index / bank.phases)
    return Phases(
        np.array([shot.given.number for shot in shots]),
        np.array(alone),
        np.array(
            [
                np.nan if shot.match.body is None else shot.match.phase_index / bank.phases
                for shot in shots
            ]
        ),
        np.array(
            [np.nan if shot.given.phase is None else shot.given.phase for shot in shots], float
        ),
    )


def draw_phases(phases: Phases) -> Image:
    """Draw both over the frames, side by side, over the true phases if they are known."""
    width, height = _PANEL
    image = blank(2 * width, height)
    numbers = phases.numbers
    ticks = np.unique(np.linspace(numbers[0], numbers[-1], 5).round())
    panels = (('each frame alone', phases.alone, ORANGE), ('best path', phases.path, BLUE))
    for place, (title, values, colour) in enumerate(panels):
        left = place * width
        area = (left + 50, 64, left + width - 20, height - 46)
        plot = Plot(image, area, (float(numbers[0]), float(numbers[-1])), (0, 1))
        plot.axes(ticks, (0, 0.25, 0.5, 0.75, 1), ('frame', 'phase'))
        plot.dots(_points(numbers, phases.shown_truth()), GREY, 5)
        plot.dots(_points(numbers, values), colour, 3)
        words = f'{title}: {phases.backward(values):.0f} % of the steps go back'
        text(image, words, (left + 50, 20), size=0.42)
        error = phases.rms(values)
        if np.isfinite(error):
            words = f'RMS {error:.1f} % of the whole stride (grey: the truth)'
            text(image, words, (left + 50, 38), size=0.42)
    return image


def _points(numbers: NDArray[np.int64], values: NDArray[np.float64]) -> list[tuple[float, float]]:
    pairs = zip(numbers, values, strict=True)
    return [(float(number), float(value)) for number, value in pairs if np.isfinite(value)]
