#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Learn what tells walkers from other things that move, from synthetic ones.

Plays synthetic walkers, a third of them cut by the image's border, and synthetic things that move
to the search for walkers, fits a logistic regression to the measures of all matches and prints
its coefficients; ``--write`` changes ``walking.json`` of the package.  ``--check`` plays other
walkers and things instead and says which are found, and when::

    python benchmarks/walking.py [--walkers 40] [--seeds 3] [--write | --check]

Of the walkers' matches those count whose box overlaps the true one by an IoU of at least 0.5.
Every clip has the same weight, and walkers all together have that of the things.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from sklearn.linear_model import LogisticRegression
from sklearn.preprocessing import StandardScaler

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from benchmarks.synthetic.things import THINGS, ThingClip
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.starting import StartingConfig, WalkerFinder
from gait_segmentation.starting.finding.walking import MODEL_FILE
from gait_tools.gait_model import FIGURES

RIGHT = 0.5
DIRECTIONS = 10
SURE = 100.0  # evidence that nobody reaches
RARE, USUAL = 1, 50  # percentiles of walkers between which a measure counts
MORE = ('similarity', 'swing', 'accord', 'cover')  # measures that speak for a walker

Frame = tuple[NDArray[np.uint8], int, Box | None]


class Match(NamedTuple):
    """What was measured of one match, and the IoU of its box with the walker's."""

    clip: str
    walker: bool
    iou: float
    measures: dict[str, float]


def walker(seed: int) -> Iterator[Frame]:
    """Draw a walker; each third is cut by the lower border, the odd ones of them by the upper."""
    rng = np.random.default_rng([seed, 77])
    clip = SyntheticSequence(
        SyntheticConfig(
            seed=1000 + seed,
            azimuth=2 * math.pi * seed / DIRECTIONS + float(rng.uniform(-0.15, 0.15)),
            build=FIGURES[seed % len(FIGURES)],
            person_height=float(rng.uniform(45, 150)),
            pan=float(rng.choice([0, 0, 0, 1.5, -1.5])),
            clutter=float(rng.uniform(0.2, 1)),
            shadow=bool(rng.random() < 0.5),
            stride_rate=float(rng.uniform(0.7, 1.1)),
            noise=float(rng.uniform(1.5, 5)),
            blur=float(rng.uniform(0.4, 1.2)),
        )
    )
    box = clip.frame(clip.config.frames // 2).boxes[0]
    assert box is not None
    top, bottom = 0, clip.config.height
    if seed % 3 == 0:
        cut = round(float(rng.uniform(0.05, 0.4)) * box.height)
        bottom = max(round(box.bottom) - cut, 60) if seed % 2 == 0 else bottom
        top = min(round(box.y) + cut // 2, bottom - 60) if seed % 2 else top
    for frame in clip:
        truth = frame.boxes[0]
        if truth is not None:
            truth = truth.shifted(0, -top).clipped(clip.config.width, bottom - top)
        yield np.ascontiguousarray(frame.image[top:bottom]), frame.stamp_ns, truth


def thing(name: str, seed: int) -> Iterator[Frame]:
    return ((image, stamp_ns, None) for image, stamp_ns in ThingClip(name, seed))


def measured(name: str, frames: Iterable[Frame], seed: int = 0) -> Iterator[Match]:
    finder = WalkerFinder(default_bank(), StartingConfig(least_evidence=SURE))
    for image, stamp_ns, truth in frames:
        finder.update(image, stamp_ns)
        for box, measures in finder.judged():
            iou = 0.0 if truth is None else box.iou(truth)
            yield Match(f'{name} {seed}', name not in THINGS, iou, measures)


def fitted(matches: list[Match]) -> dict[str, object]:
    """Return the model of ``walking.json``."""
    matches = [each for each in matches if each.iou >= RIGHT or not each.walker]
    names = list(matches[0].measures)
    values = np.array([list(each.measures.values()) for each in matches])
    right = np.array([each.walker for each in matches])
    # What is more than usual for a walker does not make up for what is not there.
    rare, usual = (np.percentile(values[right], [at, 100 - at], axis=0) for at in (RARE, USUAL))
    better = np.array([name in MORE for name in names])
    low, high = np.where(better, rare[0], usual[1]), np.where(better, usual[0], rare[1])
    values = np.clip(values, low, high)
    clips, counts = np.unique([each.clip for each in matches], return_counts=True)
    of_clip = dict(zip(clips, counts, strict=True))
    weights = np.array([1 / of_clip[each.clip] for each in matches])
    for kind in (False, True):
        weights[right == kind] /= weights[right == kind].sum()
    scale = StandardScaler().fit(values)
    model = LogisticRegression(max_iter=2000)
    model.fit(scale.transform(values), right, weights * len(weights) / 2)
    slopes = model.coef_[0] / scale.scale_
    for name, slope in zip(names, model.coef_[0], strict=True):
        print(f'{name:12} {slope:6.2f} a standard deviation')
    return {
        'about': 'Log-odds of a walker: intercept + sum of weight x measure cut to its range',
        'intercept': round(float(model.intercept_[0] - slopes @ scale.mean_), 3),
        'measures': {
            name: [round(float(each), 3) for each in row]
            for name, row in zip(names, zip(slopes, low, high, strict=True), strict=True)
        },
    }


def found(frames: Iterable[Frame]) -> tuple[int, float] | None:
    """Return when something is first found, and the IoU of its box with the walker's."""
    finder = WalkerFinder(default_bank())
    for number, (image, stamp_ns, truth) in enumerate(frames):
        for box in finder.update(image, stamp_ns):
            return number, 0.0 if truth is None else box.iou(truth)
    return None


def check(walkers: range, seeds: range) -> None:
    """Print which clips give a slot."""
    right = [found(walker(seed)) for seed in walkers]
    frames = [each[0] for each in right if each is not None and each[1] >= RIGHT]
    mean = statistics.fmean(frames) if frames else None
    print(f'found {len(frames)} of {len(right)} walkers, in the mean in frame {mean}')
    names = [f'{name} {seed}' for name in THINGS for seed in seeds if found(thing(name, seed))]
    print(f'taken for walkers {len(names)} of {len(THINGS) * len(seeds)}: {", ".join(names)}')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--walkers', type=int, default=40)
    parser.add_argument('--seeds', type=int, default=3, help='clips of each kind of thing')
    parser.add_argument('--write', action='store_true', help='change walking.json')
    parser.add_argument('--check', action='store_true', help='play other clips')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    if options.check:
        check(range(options.walkers, 2 * options.walkers), range(options.seeds, 2 * options.seeds))
        return
    matches: list[Match] = []
    for seed in range(options.walkers):
        matches += measured(f'walker {seed}', walker(seed))
    for name in THINGS:
        for seed in range(options.seeds):
            matches += measured(name, thing(name, seed), seed)
    model = fitted(matches)
    if options.write:
        MODEL_FILE.write_text(json.dumps(model, indent=1) + '\n', encoding='utf-8')


if __name__ == '__main__':
    sys.exit(run_tool('walking.py', main))
