# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Run the pipeline over synthetic walkers of many seeds and print how well it did.

Direction, size, clothes, background and the camera's motion differ from seed to seed.  Prints J
of every seed, and mean, worst and phase error over all; promised are a mean J >= 0.93 and no seed
below 0.85.  Usage::

    python benchmarks/walkers.py [--seeds 20] [--frames 50] [--sheet FILE.png] [--json FILE]
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

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.drawing import Image
from gait_segmentation.evaluation.output import TILE_HEIGHT, TILE_SIZE, tile, write_image
from gait_segmentation.evaluation.report import aligned
from gait_segmentation.evaluation.runner import Outcome, run
from gait_segmentation.gait_model import FIGURES
from gait_segmentation.geometry import Box
from gait_segmentation.pipeline import Pipeline
from gait_segmentation.sheets import contact_sheet, region_about

LEAST_MEAN, LEAST_WORST = 0.93, 0.85
DIRECTIONS = (0.0, math.pi, 0.6, math.pi - 0.6, 1.4, -1.4)


def config_of(seed: int, frames: int) -> SyntheticConfig:
    """Vary what differs between clips with the seed."""
    rng = np.random.default_rng([seed, 1])
    return SyntheticConfig(
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


def phase_error(outcomes: list[Outcome], clip: SyntheticSequence) -> float:
    """Return the mean error in strides, the legs not told apart; NaN without a phase."""
    wrong = [
        outcome.phase - clip.frame(outcome.number).phases[0]
        for outcome in outcomes
        if not math.isnan(outcome.phase)
    ]
    return statistics.fmean(abs((each + 0.25) % 0.5 - 0.25) for each in wrong or [math.nan])


def picture_of(outcome: Outcome, clip: SyntheticSequence) -> Image:
    frame = clip.frame(outcome.number)
    box = frame.boxes[0] or Box(0, 0, frame.image.shape[1], frame.image.shape[0])
    region = region_about(box, TILE_HEIGHT * box.height, TILE_SIZE)
    return tile(frame.image, outcome, frame.truths[0], region)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--frames', type=int, default=50)
    parser.add_argument('--sheet', type=Path, help='write the middle frame of every seed')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write the figures here')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows = [['seed', 'azimuth', 'build', 'px', 'pan', 'J', 'worst J', 'phase error', 'ms']]
    means, phases, tiles = [], [], []
    for seed in range(options.seeds):
        config = config_of(seed, options.frames)
        clip = SyntheticSequence(config)
        box = clip.initial_box
        if box is None:
            continue
        pipeline = Pipeline(clock=time.perf_counter)
        outcomes = list(run(pipeline, clip, clip.numbers, box, clock=time.perf_counter))
        scores = [outcome.score.j for outcome in outcomes if outcome.score is not None]
        means.append(statistics.fmean(scores))
        phases.append(phase_error(outcomes, clip))
        rows.append(
            [
                str(seed),
                f'{config.azimuth:.2f}',
                config.build,
                f'{config.person_height:.0f}',
                f'{config.pan:g}',
                f'{means[-1]:.3f}',
                f'{min(scores):.3f}',
                f'{phases[-1]:.3f}',
                f'{1e3 * statistics.median(outcome.seconds for outcome in outcomes):.1f}',
            ]
        )
        tiles.append(picture_of(outcomes[len(outcomes) // 2], clip))
    print(aligned(rows))
    mean, worst = statistics.fmean(means), min(means)
    known = [each for each in phases if not math.isnan(each)]
    phase = statistics.fmean(known) if known else None
    print(f'\n{len(means)} seeds; phase error (legs not told apart), strides: {phase}')
    fine = True
    for what, value, limit in (('mean J', mean, LEAST_MEAN), ('worst J', worst, LEAST_WORST)):
        fine &= value >= limit
        print(f'{"ok  " if value >= limit else "MISS"} {what}: {value:.4f} >= {limit:g}')
    if options.sheet is not None:
        write_image(options.sheet, contact_sheet(tiles, 7))
    if options.json is not None:
        report = {'mean': mean, 'worst': worst, 'phase_error': phase, 'j': means}
        options.json.write_text(json.dumps(report, indent=1) + '\n')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('walkers.py', main))
