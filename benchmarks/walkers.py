#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Run the pipeline over synthetic walkers of many seeds and print how well it did.

Direction, size, clothes, background and the camera's motion differ from seed to seed.  Prints J
of every seed, and mean and worst over all; promised are a mean J >= 0.93 and no seed below 0.85.
Usage::

    python benchmarks/walkers.py [--seeds 20] [--frames 50] [--json FILE] [--pictures docs/images]

``--pictures`` writes ``good.jpg``, the clips at the quartiles by mean J each in its median frame,
and ``bad.jpg``, the worst frames of the three worst clips; the upper row is without a shape prior.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import replaced
from gait_segmentation.drawing import Image, draw_label
from gait_segmentation.geometry import Box
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.sheets import TILE_SIZE, contact_sheet, tile
from gait_tools.evaluation.output import outlines, write_image
from gait_tools.evaluation.report import aligned
from gait_tools.evaluation.runner import Outcome, run
from gait_tools.gait_model import FIGURES

FRAMES = 50
LEAST_MEAN, LEAST_WORST = 0.93, 0.85
DIRECTIONS = (0.0, math.pi, 0.6, math.pi - 0.6, 1.4, -1.4)


def walk(
    seed: int, frames: int = FRAMES, config: PipelineConfig | None = None
) -> tuple[SyntheticSequence, list[Outcome]]:
    """Run the pipeline over the clip of a seed."""
    rng = np.random.default_rng([seed, 1])
    clip = SyntheticSequence(
        SyntheticConfig(
            seed=seed,
            frames=frames,
            azimuth=DIRECTIONS[seed % len(DIRECTIONS)],
            build=FIGURES[seed % len(FIGURES)],
            person_height=float(rng.uniform(60, 150)),
            pan=float(rng.choice([0.0, 0.0, 1.5, -1.5])),
            clutter=float(rng.uniform(0.2, 1.0)),
            shadow=bool(rng.random() < 0.3),
            stride_rate=float(rng.uniform(0.75, 1.05)),
        )
    )
    assert clip.initial_box is not None
    pipeline = Pipeline(config, clock=time.perf_counter)
    outcomes = run(pipeline, clip, clip.numbers, clip.initial_box, clock=time.perf_counter)
    return clip, list(outcomes)


def picture_of(outcome: Outcome, clip: SyntheticSequence, prior: str) -> Image:
    frame = clip.frame(outcome.number)
    box = frame.boxes[0] or Box(0, 0, frame.image.shape[1], frame.image.shape[0])
    about = f'{outcome.number:04d}' + (
        '' if outcome.score is None else f'  J {outcome.score.j:.3f}'
    )
    picture = tile(frame.image, box, outlines(outcome.mask, frame.truths[0]), about)
    draw_label(picture, prior, (2, TILE_SIZE[1]))
    return picture


def draw_good_and_bad(scores: list[dict[int, float]], folder: Path, frames: int) -> None:
    """Draw frames that are chosen by J."""
    ranked = sorted(range(len(scores)), key=lambda seed: statistics.fmean(scores[seed].values()))
    by_j = [sorted(each, key=each.__getitem__) for each in scores]
    quartiles = [ranked[round(part * (len(ranked) - 1))] for part in (0.25, 0.5, 0.75)]
    chosen = {
        'good': [(seed, by_j[seed][len(by_j[seed]) // 2]) for seed in quartiles],
        'bad': [(seed, by_j[seed][0]) for seed in ranked[:3]],
    }
    for name, among in chosen.items():
        print(f'{name}: {among}')
        tiles = []
        for prior in ('none', 'default'):
            config = replaced(PipelineConfig(), 'segmentation', 'prior', prior)
            for seed, number in among:
                clip, outcomes = walk(seed, frames, config)
                tiles.append(picture_of(outcomes[number], clip, prior))
        write_image(folder / f'{name}.jpg', contact_sheet(tiles, len(among)))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--frames', type=int, default=FRAMES)
    parser.add_argument('--pictures', type=Path, metavar='DIR', help='write good and bad frames')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write the figures here')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows = [['seed', 'azimuth', 'build', 'px', 'pan', 'J', 'worst J']]
    js = []
    for seed in range(options.seeds):
        clip, outcomes = walk(seed, options.frames)
        js.append({each.number: each.score.j for each in outcomes if each.score is not None})
        mean, worst = statistics.fmean(js[-1].values()), min(js[-1].values())
        about = clip.config
        row = f'{seed} {about.azimuth:.2f} {about.build} {about.person_height:.0f} {about.pan:g} '
        row += f'{mean:.3f} {worst:.3f}'
        rows.append(row.split())
    print(aligned(rows))
    means = [statistics.fmean(each.values()) for each in js]
    mean, worst = statistics.fmean(means), min(means)
    fine = holds('mean J', mean, LEAST_MEAN, least=True)
    fine &= holds('worst J', worst, LEAST_WORST, least=True)
    if options.pictures is not None:
        draw_good_and_bad(js, options.pictures, options.frames)
    if options.json is not None:
        report = {'mean': mean, 'worst': worst, 'j': means}
        options.json.write_text(json.dumps(report, indent=1) + '\n')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('walkers.py', main))
