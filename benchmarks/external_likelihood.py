#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The open door: a detector's bad heat map, refined by shape sequences.

The true masks are spoilt: a fifth of the pixels is flipped, and parts of the person are missing
for some frames at a time.  ``--blurred`` makes maps as those of a network of low resolution, which
are far harder: without what is thinner than 0.06 heights (arms, shins), shifted by up to 0.02,
blurred by 0.02, between 0.1 and 0.9, with the holes, but nothing flipped.

The maps are used as ``gait_evaluate --likelihood`` uses files.  Prints the share of wrong pixels
in the scored window, of the maps (above one half) and of the masks made of them; promised is that
of the masks over that of the maps <= 0.6, in the mean.  Usage::

    python benchmarks/external_likelihood.py [--seeds 8] [--data DIR ...] [--blurred]
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline
from gait_tools.evaluation.metrics import score_frame, true_box
from gait_tools.evaluation.report import aligned
from gait_tools.evaluation.runner import Clip, run
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import load_sequences
from gait_tools.evaluation.truth import PERSON

MOST = 0.6
FLIPPED = 0.2
"""Share of the pixels that are flipped."""

HOLES, SIZE, LIFE = 4, (0.05, 0.1), 12
"""Parts missing at a time, half axes of each in heights, frames for which they stay."""

LIMB, SHIFT, BLUR, LEAST = 0.03, 0.02, 0.02, 0.1
"""Blurred maps: radius that limbs are thinner than, shift, blur (heights), and least value."""

Part = tuple[NDArray[np.float64], NDArray[np.float64], float]
"""An ellipse: its place about the true box's centre and half axes in its heights, and angle."""


class Detector:
    """Makes bad heat maps of true masks, frame by frame; the same seed makes the same maps."""

    def __init__(self, seed: int, *, blurred: bool = False) -> None:
        """
        Start with the first frame.

        :param blurred: whether maps are blurred, shifted and without limbs, and not flipped.
        """
        self._blurred = blurred
        self._rng = np.random.default_rng(seed)
        self._frame = 0

    def __call__(self, truth: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the map of one frame, (H, W) uint8."""
        if self._frame % LIFE == 0:
            self._holes = [self._part() for _ in range(HOLES)]
            self._shift = self._rng.uniform(-SHIFT, SHIFT, 2)
        self._frame += 1
        mask = np.where(truth == PERSON, 255, 0).astype(np.uint8)
        box = true_box(truth)
        height = 1.0 if box is None else box.height
        if box is not None:
            if self._blurred:
                side = 2 * max(1, round(LIMB * height)) + 1
                disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
                mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disk)
            for place, axes, angle in self._holes:
                x, y = np.rint((box.center_x, box.center_y) + place * height).astype(int)
                across, along = np.maximum(np.rint(axes * height), 1).astype(int)
                cv2.ellipse(mask, (x, y), (across, along), angle, 0, 360, 0, -1)
        if not self._blurred:
            flipped = self._rng.random(mask.shape) < FLIPPED
            return np.where(flipped, 255 - mask, mask).astype(np.uint8)
        move = np.hstack([np.eye(2), self._shift[:, None] * height])
        moved = cv2.warpAffine(mask, move, mask.shape[::-1], borderMode=cv2.BORDER_REPLICATE)
        soft = cv2.GaussianBlur(moved, (0, 0), BLUR * height).astype(np.float32)
        return np.round(255 * LEAST + (1 - 2 * LEAST) * soft).astype(np.uint8)

    def _part(self) -> Part:
        rng = self._rng
        place = np.array([rng.uniform(-0.15, 0.15), rng.uniform(-0.45, 0.45)])
        return place, rng.uniform(*SIZE, 2), rng.uniform(0, 180)


def synthetic(seed: int) -> SyntheticSequence:
    """Make up a walker."""
    rng = np.random.default_rng([seed, 2])
    return SyntheticSequence(
        SyntheticConfig(
            seed=seed,
            azimuth=float(rng.choice([0.0, math.pi, 0.6, -0.6, 1.3])),
            build=str(rng.choice(['average', 'dress', 'rucksack'])),
            person_height=float(rng.uniform(90, 150)),
            pan=float(rng.choice([0.0, 1.5])),
        )
    )


def measure(clip: Clip, starts: Mapping[int, Iterable[Box]], detector: Detector) -> list[float]:
    """Refine the maps of a clip; return the error in percent before and after, and J."""
    before, maps = [], {}
    for number in clip.numbers:
        truth = clip.truth(number)
        seen = np.zeros(clip.image(number).shape[:2], np.uint8) if truth is None else truth
        maps[number] = detector(seen)
        if truth is not None:
            found = np.where(maps[number] > 127, 255, 0).astype(np.uint8)
            before.append(score_frame(found, None, truth).error_rate)
    outcomes = run(
        Pipeline(), clip, clip.numbers, starts, clock=time.perf_counter, likelihood=maps.get
    )
    scores = [outcome.score for outcome in outcomes if outcome.score is not None]
    after = statistics.fmean(score.error_rate for score in scores)
    return [statistics.fmean(before), after, statistics.fmean(score.j for score in scores)]


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--seeds', type=int, default=8, help='synthetic walkers (default: %(default)s)')
    add('--data', type=Path, nargs='+', default=[], metavar='DIR', help='sequence folders')
    add('--blurred', action='store_true', help='maps without limbs, shifted and blurred')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    compile_kernels()
    given = load_sequences(options.data)
    ratios, rows = [], [['sequence', 'error % before', 'after', 'ratio', 'J after']]
    for seed, clip in enumerate([*map(synthetic, range(options.seeds)), *given]):
        detector = Detector(seed, blurred=options.blurred)
        known = isinstance(clip, Sequence)
        box = None if known else clip.initial_box
        starts = clip.starts if known else {0: () if box is None else (box,)}
        before, after, j = measure(clip, starts, detector)
        ratios.append(after / before)
        name = clip.name if known else f'seed {seed}'
        rows.append([name, f'{before:.3f}', f'{after:.3f}', f'{ratios[-1]:.3f}', f'{j:.4f}'])
    print(aligned(rows))
    ratio = statistics.fmean(ratios)
    fine = holds('error after over before', ratio, MOST, more=f'(worst {max(ratios):.3f})')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('external_likelihood.py', main))
