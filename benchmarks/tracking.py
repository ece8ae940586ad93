#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Run the synthetic scenes, with boxes and without, and print what tracking must show.

Prints the scores of every scene, the bars with what was measured, and what the tracking stage
takes a frame for one to five people (CPU time of all threads: other programs do not count) and
frames per second of the whole pipeline with five (time on the clock: leave the machine alone).
Sequence folders given with ``--data`` are held to the bars of real clips.  ``--keep`` writes the
scenes as sequence folders with labels.  With ``--heat-map`` all runs have maps that do not tell
people apart: the union of the true masks, blurred, with a tenth of its blocks inverted.  Usage::

    python benchmarks/tracking.py [--scenes crossing pillar ...] [--seeds 1] [--json FILE]
        [--data ../data/hall ../data/shopfront ...] [--set STAGE.PARAM=VALUE] [--keep DIR]
        [--heat-map]
"""

from __future__ import annotations

import argparse
import contextlib
import inspect
import itertools
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.synthetic import SyntheticFrame
from benchmarks.synthetic.scenes import SCENES, scene
from gait_segmentation.cli.tool import check_file, run_tool
from gait_segmentation.config import overridden, replaced
from gait_segmentation.files.image_files import read_grey
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_tools.evaluation.output import write_image
from gait_tools.evaluation.report import (
    aligned,
    mean_tracking,
    tracking_table,
    write_json,
)
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import Session, load_sequences

MAPS, BLUR, BLOCK, INVERTED = 'map', 4.0, 8, 0.1
"""Folder of heat maps, their blur and the side of their blocks in pixels, and share inverted."""

Numbers = dict[str, Any]

AUTO_SCENES = tuple(name for name in SCENES if name not in ('same-colour', 'same-lightness'))
"""Scenes run without boxes as well: not those that hide people from a search for motion."""

SKIPPED = 10
"""Frames at the beginning that are not timed: nobody is there before the first box."""


class Bar(NamedTuple):
    """What a score must be at most, or at least; None counts as 0, ``missing`` must be 0."""

    what: str
    score: str
    value: float
    least: bool = False
    missing: str = ''


LOCK = Bar('lock', 'lock_seconds', 1.0, missing='never_locked')
NO_GHOST = Bar('false slots', 'false_slots', 0)
KEPT = Bar('lost frames', 'lost_frames', 0)
SAME_ID = Bar('id switches', 'id_switches', 0)
BACK = Bar('back', 'recovery_seconds', 1.0, missing='never_recovered')
NEW_ID = Bar('ids of two people', 'shared_ids', 0)
J_MANY = Bar('J', 'J', 0.88, least=True)
BOX = Bar('box IoU', 'box_iou', 0.85, least=True)

BARS: dict[str, dict[str, tuple[Bar, ...]]] = {
    'box': {
        **dict.fromkeys(('crossing', 'overtaking'), (SAME_ID, J_MANY)),
        **dict.fromkeys(('pillar', 'grey'), (BACK, SAME_ID)),
        **dict.fromkeys(('same-colour', 'same-lightness', 'standing'), (KEPT,)),
        **dict.fromkeys(('turning', 'exposure', 'shaken'), (KEPT,)),
        'exit-enter': (NEW_ID,),
        'exit-return': (BACK,),
    },
    'auto': {
        **dict.fromkeys(('pillar', 'cars', 'trees'), (LOCK, NO_GHOST)),
        **dict.fromkeys(('shaken', 'standing', 'turning'), (LOCK, NO_GHOST)),
        'exit-enter': (NEW_ID, LOCK, NO_GHOST),
        # There is no whole second between the jumps.
        'exposure': (NO_GHOST,),
    },
}
DATA_BARS = {'box': (KEPT,), 'auto': (LOCK, NO_GHOST)}
MEAN_BARS = {'box': (BOX,), 'auto': ()}


def write_maps(folder: Path) -> None:
    """Write heat maps of all labelled people of a scene beside its frames."""
    rng = np.random.default_rng(0)
    for path in sorted((folder / 'labels').iterdir()):
        people = cv2.compare(read_grey(path), 0, cv2.CMP_GT)
        soft = np.asarray(cv2.GaussianBlur(people, (0, 0), BLUR))
        blocks = rng.random([math.ceil(size / BLOCK) for size in soft.shape]) < INVERTED
        wrong = np.kron(blocks, np.ones((BLOCK, BLOCK), bool))[: soft.shape[0], : soft.shape[1]]
        write_image(folder / MAPS / path.name, np.where(wrong, 255 - soft, soft))


def evaluate(
    sequences: list[Sequence],
    config: PipelineConfig,
    auto: bool,
    fixed: Iterable[str],
    heat_map: str = '',
) -> Any:
    session = Session(
        sequences,
        lambda config: Pipeline(config, clock=time.process_time),
        time.perf_counter,
        auto=auto,
        heat_map=heat_map,
        fixed=frozenset(fixed),
        progress=lambda items, name, total: tqdm(items, name, total, disable=None, leave=False),
    )
    return session.evaluate(config, name='auto' if auto else 'box')


def check(name: str, init: str, numbers: Numbers, bars: Iterable[Bar]) -> list[Numbers]:
    """Print what was measured beside its bars, and return it."""
    scores, found = numbers['tracking'], []
    for bar in bars:
        value = scores[bar.score]
        if value is None or (bar.missing and scores[bar.missing]):
            value = math.inf if scores.get(bar.missing) else 0
        met = holds(f'{name}, {init}, {bar.what}', value, bar.value, least=bar.least)
        found.append(
            {'scene': name, 'init': init, 'what': bar.what, 'measured': value, 'met': met}
        )
    return found


def started(
    config: PipelineConfig, people: int, frame: SyntheticFrame, **options: Any
) -> Pipeline:
    """Return a pipeline that tracks the first people of a frame."""
    config = replaced(config, 'people', 'max_people', people)
    pipeline = Pipeline(replaced(config, 'starting', 'auto_init', 'none'), **options)
    for box in frame.boxes[:people]:
        if box is not None:
            pipeline.initialize(box)
    return pipeline


def cost(config: PipelineConfig, frames: list[SyntheticFrame]) -> list[Numbers]:
    """Time the first 1 to 5 people, the counts taking turns."""
    runs = {n: started(config, n, frames[0], clock=time.process_time) for n in range(1, 6)}
    times: dict[int, list[dict[str, float]]] = {people: [] for people in runs}
    for frame, people in itertools.product(frames, runs):
        for result in runs[people].update(frame.image, frame.stamp_ns):
            times[people].append(result.timings_ms)
    return [
        {'people': people}
        | {
            stage: statistics.median(each[stage] for each in taken[SKIPPED:])
            for stage in ('tracking', 'matching', 'segmentation', 'total')
        }
        for people, taken in times.items()
    ]


def cost_table(rows: list[Numbers]) -> str:
    names = list(rows[0])
    cells = [[str(row['people'])] + [f'{row[name]:.2f}' for name in names[1:]] for row in rows]
    first, further = rows[0]['tracking'], (rows[-1]['tracking'] - rows[0]['tracking']) / 4
    return (
        'scene five, ms of CPU per frame in all threads, median\n'
        f'{aligned([names, *cells])}\n'
        f'tracking: {first:.2f} ms (<= 4), each further person {further:.2f} ms (<= 2)'
    )


def speed(config: PipelineConfig, frames: list[SyntheticFrame], threads: int) -> float:
    """Return frames per second, on the clock, of the whole pipeline with five people."""
    pipeline = started(config, 5, frames[0])
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    began = time.perf_counter()
    for frame in frames:
        pipeline.update(frame.image, frame.stamp_ns)
    taken = time.perf_counter() - began
    cv2.setNumThreads(before)
    return len(frames) / taken


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__.split('\n\n')[0],
        epilog='\n'.join(f'{name:16}{inspect.getdoc(make)}' for name, make in SCENES.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--scenes', nargs='*', choices=list(SCENES), default=list(SCENES))
    parser.add_argument('--seeds', type=int, default=1, help='how many of each scene')
    parser.add_argument('--data', nargs='*', type=Path, default=[], metavar='SEQUENCE_DIR')
    parser.add_argument('--init', nargs='*', choices=['box', 'auto'], default=['box', 'auto'])
    parser.add_argument('--set', action='append', default=[], metavar='STAGE.PARAM=VALUE')
    parser.add_argument('--heat-map', action='store_true', help='give a map of all people')
    parser.add_argument('--keep', type=Path, metavar='DIR', help='keep the scenes in DIR')
    parser.add_argument('--no-cost', action='store_true', help='leave the times out')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all numbers to a file')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    config = overridden(PipelineConfig(), options.set)
    scenes = {
        name if options.seeds == 1 else f'{name}-{seed}': (name, seed)
        for name, seed in itertools.product(options.scenes, range(options.seeds))
    }
    # Before all that takes long.
    data = load_sequences(options.data)
    for sequence in data:
        if sequence.name in scenes:
            parser.error(f'{sequence.folder} has the name of a scene')
    if options.json is not None:
        check_file(options.json)
    fixed = [setting.partition('=')[0].strip() for setting in options.set]
    compile_kernels()
    report: Numbers = {'bars': []}
    keep = contextlib.nullcontext(options.keep) if options.keep else tempfile.TemporaryDirectory()
    with keep as root:
        for key, (name, seed) in scenes.items():
            scene(name, seed).write(Path(root) / key)
            if options.heat_map:
                write_maps(Path(root) / key)
        made = load_sequences(Path(root) / key for key in scenes)
        for init in options.init:
            chosen = [
                each for each in made if init == 'box' or scenes[each.name][0] in AUTO_SCENES
            ]
            if not chosen and not data:
                continue
            maps = MAPS if options.heat_map else ''
            report[init] = evaluate([*chosen, *data], config, init == 'auto', fixed, maps)
            print(f'init {init}\n{tracking_table(report[init])}\n')
            for key, numbers in report[init]['sequences'].items():
                real = key not in scenes
                bars = DATA_BARS[init] if real else BARS[init].get(scenes[key][0], ())
                report['bars'] += check(key, init, numbers, bars)
            if data:
                found = [report[init]['sequences'][each.name] for each in data]
                mean = {'tracking': mean_tracking(numbers['tracking'] for numbers in found)}
                report['bars'] += check('mean of data', init, mean, MEAN_BARS[init])
    if not options.no_cost:
        frames = list(scene('five'))
        report['ms_per_frame'] = rows = cost(config, frames)
        report['frames_per_second'] = {str(n): speed(config, frames, n) for n in (1, 2)}
        print(f'\n{cost_table(rows)}')
        for threads, rate in report['frames_per_second'].items():
            print(f'whole pipeline, OpenCV threads: {threads}: {rate:.1f} frames/s (>= 20)')
    if options.json is not None:
        write_json(options.json, report)
    return 0 if all(bar['met'] for bar in report['bars']) else 1


if __name__ == '__main__':
    sys.exit(run_tool('tracking.py', main))
