#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Pictures of good and of bad frames for docs/results.md, without a shape prior and with it.

Twenty synthetic walkers, of which J chooses: clips at the quartiles of all, each at its median
frame, are the good ones; the worst frames of the three worst clips are the bad ones.  Then frames
of the demonstration's film, which has no ground truth, by number.  Found is green, true
magenta::

    python benchmarks/pictures.py [--out docs/images] [--seeds 20]
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.synthetic import SyntheticSequence
from benchmarks.walkers import config_of, picture_of
from gait_segmentation.cli.clip import CLIP_BOX, CLIP_START, demo_clip
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import replaced
from gait_segmentation.drawing import Image, draw_label
from gait_segmentation.evaluation.output import TILE_HEIGHT, TILE_SIZE, tile, write_image
from gait_segmentation.evaluation.runner import Outcome, run
from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.sheets import contact_sheet, region_about

PRIORS = ('none', 'default')
FRAMES = 50
"""Of each synthetic clip, as in synthetic.py."""

QUARTILES = (0.25, 0.5, 0.75)
WORST = 3
FILM_WIDTH = 960
FILM_GOOD, FILM_BAD = (100, 140), (77, 177)
"""Frames of the film."""


@dataclass(frozen=True)
class Choice:
    """A frame of a synthetic clip, by its seed and number."""

    seed: int
    number: int


def pipeline_of(prior: str) -> Pipeline:
    config = replaced(PipelineConfig(), 'segmentation', 'prior', prior)
    return Pipeline(config, clock=time.perf_counter)


def synthetic_outcomes(seed: int, prior: str) -> tuple[SyntheticSequence, dict[int, Outcome]]:
    clip = SyntheticSequence(config_of(seed, FRAMES))
    assert clip.initial_box is not None
    outcomes = run(
        pipeline_of(prior), clip, clip.numbers, clip.initial_box, clock=time.perf_counter
    )
    return clip, {outcome.number: outcome for outcome in outcomes}


def choices(seeds: int) -> tuple[list[Choice], list[Choice]]:
    """Choose good and bad frames by what the default makes of them."""
    scores = {}
    for seed in tqdm(range(seeds), desc='choosing'):
        _, outcomes = synthetic_outcomes(seed, 'default')
        scores[seed] = {n: out.score.j for n, out in outcomes.items() if out.score is not None}
    ranked = sorted(scores, key=lambda seed: statistics.fmean(scores[seed].values()))
    good = []
    for part in QUARTILES:
        seed = ranked[round(part * (len(ranked) - 1))]
        by_j = sorted(scores[seed], key=scores[seed].__getitem__)
        good.append(Choice(seed, by_j[len(by_j) // 2]))
    bad = [
        Choice(seed, min(scores[seed], key=scores[seed].__getitem__)) for seed in ranked[:WORST]
    ]
    return good, bad


def film_tiles(prior: str, numbers: tuple[int, ...]) -> Iterator[Image]:
    film = open_input(demo_clip(), width=FILM_WIDTH, start=CLIP_START, count=max(numbers) + 1)
    pipeline = pipeline_of(prior)
    box = CLIP_BOX.scaled(FILM_WIDTH / open_input(demo_clip()).size[0])
    pipeline.initialize(box)
    for shown in film.frames():
        [frame] = pipeline.update(shown.image, shown.stamp_ns)
        if shown.number in numbers:
            person = frame.people[0]
            about = person.track.box or box
            region = region_about(about, TILE_HEIGHT * about.height, TILE_SIZE)
            outcome = Outcome(
                shown.number, frame.mask, about, person.match.phase, 0.0, {}, 0.0, None
            )
            yield tile(shown.image, outcome, None, region)
        if shown.number >= max(numbers):
            return


def row_of(prior: str, chosen: list[Choice], film: tuple[int, ...]) -> list[Image]:
    tiles = []
    for choice in chosen:
        clip, outcomes = synthetic_outcomes(choice.seed, prior)
        tiles.append(picture_of(outcomes[choice.number], clip))
    tiles.extend(film_tiles(prior, film))
    for each in tiles:
        draw_label(each, prior, (2, TILE_SIZE[1]))
    return tiles


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--out', type=Path, default=Path('docs/images'))
    parser.add_argument('--seeds', type=int, default=20)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    good, bad = choices(options.seeds)
    for name, chosen, film in (('good', good, FILM_GOOD), ('bad', bad, FILM_BAD)):
        print(f'{name}: {chosen}, film {film}')
        tiles = [each for prior in PRIORS for each in row_of(prior, chosen, film)]
        write_image(options.out / f'{name}.jpg', contact_sheet(tiles, len(chosen) + len(film)))
    return 0


if __name__ == '__main__':
    sys.exit(run_tool('pictures.py', main))
