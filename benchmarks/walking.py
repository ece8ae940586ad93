#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Learn what tells people from other things that move, from films with truth and synthetic ones.

Plays films and synthetic walkers (a third of them cut by the image's border) and things that move
to the search for walkers, fits a logistic regression to the measures of all that was judged and
prints its coefficients; ``--write`` changes ``walking.json`` of the package.  ``--check`` plays
other synthetic walkers and things to the pipeline instead and says which get a slot, and when, and
which keep it for more than a second::

    python benchmarks/walking.py --data DIR [--without DIR] [--walkers 40] [--seeds 3]
        [--write | --check [--by detector]]

``DIR`` holds clips with ``frames``, ``masks`` of one person, ``sequence.yaml`` and, where there
are more people, a network's maps of all in ``rvm``.  People are what overlaps the true box by an
IoU of at least 0.5; nobody is what neither box nor map shows; the rest is left out.  ``--without``
is a folder of films that show nobody, for those and for ``--check``.  Every clip has the same
weight, and people all together have that of the things.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from collections.abc import Iterable, Iterator
from itertools import pairwise
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
from gait_segmentation.inputs import open_input
from gait_segmentation.inputs.folder import load_heat_map
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.scene.scene import Scene
from gait_segmentation.starting import StartingConfig, WalkerFinder
from gait_segmentation.starting.finder import MODEL_FILE
from gait_tools.evaluation.metrics import true_box
from gait_tools.evaluation.sequence import Sequence
from gait_tools.gait_model import FIGURES

RIGHT = 0.5
WRONG, DARK = 0.05, 40  # most overlap with the person, and mean of a map, of what is nobody
FRAMES = 60  # of a clip with truth, at most
FILM_S, LARGEST = 60.0, 960  # of a film that shows nobody: seconds and width at most
DIRECTIONS = 10
SURE = 100.0  # evidence that nobody reaches
AT = (1, 50, 99)  # percentiles of people between which a measure counts, and at which it bends
KEPT_NS = 1_000_000_000
FULL = 20  # judgements from which a clip has its full weight

Frame = tuple[NDArray[np.uint8], int, Box | None, NDArray[np.uint8] | None]
"""Image, stamp, true box, and a map of people if there may be others."""


class Match(NamedTuple):
    """What was measured in one frame, and whether it is somebody."""

    clip: str
    walker: bool
    measures: dict[str, float]


def film(path: Path) -> Iterator[Frame]:
    sequence = Sequence.load(path)
    for number in list(sequence.frames)[:FRAMES]:
        image, truth = sequence.image(number), sequence.truth(number)
        box = None if truth is None else true_box(truth)
        others = path / 'rvm' / f'{sequence.frames[number].stem}.png'
        people = None
        if others.exists():
            people = np.asarray(cv2.resize(load_heat_map(others), image.shape[1::-1]))
        yield image, sequence.stamp_ns(number), box, people


def without(path: Path) -> Iterator[Frame]:
    """Read a film that shows nobody."""
    for frame in open_input(path, width=LARGEST).frames():
        if frame.header_ns > FILM_S * 1e9:
            return
        if frame.image is not None:
            yield frame.image, frame.header_ns, None, None


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
        yield np.ascontiguousarray(frame.image[top:bottom]), frame.stamp_ns, truth, None


def thing(name: str, seed: int) -> Iterator[Frame]:
    return ((image, stamp_ns, None, None) for image, stamp_ns in ThingClip(name, seed))


def measured(name: str, frames: Iterable[Frame]) -> Iterator[Match]:
    finder = WalkerFinder(default_bank(), StartingConfig(least_evidence=SURE))
    scene: Scene | None = None
    for image, stamp_ns, truth, others in frames:
        scene = scene or Scene((image.shape[0], image.shape[1]))
        scene.advance(image, stamp_ns)
        finder.update(scene)
        for box, measures in finder.judged:
            iou = 0.0 if truth is None else box.iou(truth)
            nobody = True
            if others is not None:
                part = others[box.slices(others.shape[1], others.shape[0])]
                nobody = part.size > 0 and float(part.mean()) < DARK
            if iou >= RIGHT or (iou <= WRONG and nobody):
                yield Match(name, iou >= RIGHT, measures)


def fitted(matches: list[Match]) -> dict[str, object]:
    """Return the model of ``walking.json``."""
    names = list(matches[0].measures)
    raw = np.array([list(each.measures.values()) for each in matches])
    right = np.array([each.walker for each in matches])
    bends = np.percentile(raw[right], AT, axis=0).T
    ranges = [
        (name, *pair)
        for name, row in zip(names, bends, strict=True)
        for pair in pairwise(row)
        if pair[1] - pair[0] > 1e-3
    ]
    values = np.stack([np.clip(raw[:, names.index(name)], *cut) for name, *cut in ranges], axis=1)
    weights = np.empty(len(matches))
    clips = np.array([each.clip for each in matches])
    for kind in (False, True):
        for clip in set(clips[right == kind]):
            mine = (clips == clip) & (right == kind)
            weights[mine] = min(1.0, mine.sum() / FULL) / mine.sum()
        weights[right == kind] /= weights[right == kind].sum()
    scale = StandardScaler().fit(values)
    model = LogisticRegression(max_iter=2000)
    model.fit(scale.transform(values), right, weights * len(weights) / 2)
    slopes = model.coef_[0] / scale.scale_
    rows: list[list[object]] = []
    for (name, low, high), slope, share in zip(ranges, slopes, model.coef_[0], strict=True):
        print(f'{name:12} {low:7.3f} to {high:7.3f}: {share:6.2f} a standard deviation')
        rows.append([name, *(round(float(each), 3) for each in (slope, low, high))])
    return {
        'about': 'Log-odds of a walker: intercept + sum of weight x measure cut to a range',
        'intercept': round(float(model.intercept_[0] - slopes @ scale.mean_), 3),
        'rows': rows,
    }


class Slot(NamedTuple):
    """
    The slot that something gets: from which frame on, and for how long.

    ``iou`` is that of its first box and the walker's, and ``kept`` says whether it is the same
    for more than a second.
    """

    first: int
    iou: float
    kept: bool


def slot_of(frames: Iterable[Frame], by: str) -> Slot | None:
    starting = StartingConfig(auto_init=by)
    pipeline, first, iou = Pipeline(PipelineConfig(starting=starting)), 0, 0.0
    since: dict[int, int] = {}
    kept = False
    for number, (image, stamp_ns, truth, _) in enumerate(frames):
        for result in pipeline.update(image, stamp_ns):
            track = result.people[0].track
            if not track.track_id:
                continue
            if not since and track.box is not None:
                first, iou = number, 0.0 if truth is None else track.box.iou(truth)
            kept |= stamp_ns - since.setdefault(track.track_id, stamp_ns) > KEPT_NS
    return Slot(first, iou, kept) if since else None


def check(walkers: range, seeds: range, films: list[Path], by: str) -> None:
    """Print which clips give a slot."""
    right = [slot_of(walker(seed), by) for seed in walkers]
    frames = [each.first for each in right if each is not None and each.iou >= RIGHT]
    mean = statistics.fmean(frames) if frames else None
    print(f'found {len(frames)} of {len(right)} walkers, in the mean in frame {mean}')
    print(f'{sum(each.kept for each in right if each is not None)} keep a slot')
    slots = {f'{name} {seed}': slot_of(thing(name, seed), by) for name in THINGS for seed in seeds}
    slots |= {each.name: slot_of(without(each), by) for each in films}
    wrong = {name: each for name, each in slots.items() if each is not None}
    kept = [name for name, each in wrong.items() if each.kept]
    print(f'{len(wrong)} of {len(slots)} things get a slot')
    print(f'{len(kept)} keep it: {", ".join(kept)}')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--data', type=Path, help='folder of clips with truth')
    parser.add_argument('--without', type=Path, help='folder of films that show nobody')
    parser.add_argument('--walkers', type=int, default=40)
    parser.add_argument('--seeds', type=int, default=3, help='clips of each kind of thing')
    parser.add_argument('--write', action='store_true', help='change walking.json')
    parser.add_argument('--check', action='store_true', help='play other clips')
    parser.add_argument(
        '--by', choices=('walk', 'detector'), default='walk', help='of --check: starting.auto_init'
    )
    options = parser.parse_args()
    cv2.setNumThreads(1)
    films = sorted(options.without.iterdir()) if options.without else []
    if options.check:
        walkers, seeds = options.walkers, options.seeds
        check(range(walkers, 2 * walkers), range(seeds, 2 * seeds), films, options.by)
        return
    clips = sorted(each.parent for each in (options.data or Path()).glob('*/sequence.yaml'))
    if not clips:
        parser.error(f'--data must be a folder of clips with truth, got {options.data}')
    matches: list[Match] = []
    for path in clips:
        matches += measured(path.name, film(path))
    for seed in range(options.walkers):
        matches += measured(f'walker {seed}', walker(seed))
    for name in THINGS:
        for seed in range(options.seeds):
            matches += measured(f'{name} {seed}', thing(name, seed))
    for path in films:
        matches += measured(path.name, without(path))
    model = fitted(matches)
    if options.write:
        MODEL_FILE.write_text(json.dumps(model, indent=1) + '\n', encoding='utf-8')


if __name__ == '__main__':
    sys.exit(run_tool('walking.py', main))
