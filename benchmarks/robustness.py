#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What is left of the quality when sequences are made harder.

Clips are made in memory of the sequences given: boxes drawn less carefully, the film backwards,
every second frame only, turned, dark, grey, noisy, ... cameras, people before other backgrounds, a
second person who crosses, poles and benches in front.  Prints how many clips a kind has, their
mean and worst J, and which one is the worst.  Usage::

    python benchmarks/robustness.py FOLDER ... [--kinds two hidden ...] [--boxes 3] [--each]
        [--set STAGE.PARAMETER=VALUE] [--json FILE] [--processes N]

Single clips may go one of two ways with a box one pixel larger: ``--boxes N`` runs every clip
with N start boxes moved a little, which says more than one run of each.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from itertools import permutations
from pathlib import Path

import cv2
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.variants import KINDS, PAIRED, MadeClip, moved_boxes, variants_of
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import overridden
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_tools.evaluation.report import aligned
from gait_tools.evaluation.runner import run
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import load_sequences


@dataclass(frozen=True)
class Score:
    """Mean J of a clip from each of its start boxes."""

    kind: str
    name: str
    js: tuple[float, ...]

    @property
    def j(self) -> float:
        """Return the mean over the boxes."""
        return statistics.fmean(self.js)


@cache
def clip_of(folder: str) -> MadeClip:
    return MadeClip.of(Sequence.load(folder))


def scores_of(options: argparse.Namespace, kind: str, folders: tuple[str, ...]) -> list[Score]:
    """Run what a kind makes of one sequence (and another one)."""
    cv2.setNumThreads(1)
    clips = variants_of(kind, [clip_of(folder) for folder in folders])
    return [score_of(options, kind, clip) for clip in clips]


def score_of(options: argparse.Namespace, kind: str, clip: MadeClip) -> Score:
    config = overridden(PipelineConfig(), options.set)
    js = []
    for start in moved_boxes(clip, options.boxes) or [clip]:
        pipeline = Pipeline(config)
        outcomes = run(pipeline, start, start.numbers, start.box, clock=time.perf_counter)
        js.append(statistics.fmean(each.score.j for each in outcomes if each.score is not None))
    return Score(kind, clip.name, tuple(js))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__.split('\n\n')[0],
        epilog=f'kinds: {", ".join([*KINDS, *PAIRED])}',
    )
    add = parser.add_argument
    add('folders', nargs='+', metavar='FOLDER', help='sequences with truth')
    add('--kinds', nargs='+', choices=[*KINDS, *PAIRED], metavar='KIND', help='only these')
    add('--boxes', type=int, default=0, help='start boxes a clip, moved a little')
    add('--each', action='store_true', help='print every clip, too')
    add('--set', action='append', default=[], metavar='STAGE.PARAMETER=VALUE')
    add('--json', type=Path, metavar='FILE', help='write the figures here')
    add('--processes', type=int, default=2)
    options = parser.parse_args()
    # Before all that takes long.
    overridden(PipelineConfig(), options.set)
    load_sequences(map(Path, options.folders))
    kinds = options.kinds or [*KINDS, *PAIRED]
    singles = [(folder,) for folder in options.folders]
    jobs = [
        (kind, folders)
        for kind in kinds
        for folders in (singles if kind in KINDS else permutations(options.folders, 2))
    ]
    with ProcessPoolExecutor(options.processes) as pool:
        made = pool.map(partial(scores_of, options), *zip(*jobs, strict=True))
        bar = tqdm(made, total=len(jobs), disable=None, leave=False)
        scores = [score for some in bar for score in some]
    if options.each:
        rows = [[s.kind, s.name, f'{s.j:.4f}', f'{min(s.js):.4f}'] for s in scores]
        print(aligned([['kind', 'clip', 'J', 'worst box'], *rows]) + '\n')
    rows = [['kind', 'clips', 'J', 'worst', 'clip']]
    for kind in kinds:
        of_kind = [score for score in scores if score.kind == kind]
        if of_kind:
            worst = min(of_kind, key=lambda score: score.j)
            mean = statistics.fmean(score.j for score in of_kind)
            rows.append([kind, str(len(of_kind)), f'{mean:.4f}', f'{worst.j:.4f}', worst.name])
    print(aligned(rows))
    if options.json is not None:
        report = [{'kind': s.kind, 'clip': s.name, 'j': s.js} for s in scores]
        options.json.write_text(json.dumps(report, indent=1) + '\n')
    return 0


if __name__ == '__main__':
    sys.exit(run_tool('robustness.py', main))
