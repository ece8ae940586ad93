#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What a finer camera costs: the same walker at 1920 x 1080 and scaled down.

A synthetic walker is drawn at 1920 x 1080 and scaled down by areas to 854 x 480 and 640 x 360.
Every size has a pipeline of its own; they get the frames in turn, so that what else runs on the
machine slows all of them alike.  Times are processor times of the one thread that works, in ms:
medians by stage, and the mean over all frames, the start included.  Promised is 1920 x 1080 over
640 x 360 <= 1.5, medians of the whole.  Usage::

    python benchmarks/resolution.py [--people 300 600] [--frames 40] [--json FILE]
"""

# ruff: noqa: E402 (threads are limited before NumPy is loaded)

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from pathlib import Path
from typing import Any

for _name in ('OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'OMP_NUM_THREADS'):
    os.environ[_name] = '1'  # before NumPy is loaded

import cv2

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.evaluation.metrics import score_frame
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline

SIZES = ((640, 360), (854, 480), (1920, 1080))
STAGES = ('tracking', 'matching', 'segmentation', 'total')
MOST = 1.5


def measure(person: int, frames: int, seed: int) -> dict[str, Any]:
    """Run one walker, ``person`` px tall at the full size, through all sizes."""
    clip = SyntheticSequence(
        SyntheticConfig(
            seed=seed,
            width=SIZES[-1][0],
            height=SIZES[-1][1],
            frames=frames,
            person_height=float(person),
            azimuth=0.3,
            jitter=1.0,
        )
    )
    box = clip.initial_box
    assert box is not None
    pipelines = []
    for size in SIZES:
        pipeline = Pipeline(clock=time.thread_time)
        pipeline.initialize(box.scaled(size[0] / SIZES[-1][0]))
        pipelines.append(pipeline)
    times: list[list[dict[str, float]]] = [[] for _ in SIZES]
    scores: list[list[float]] = [[] for _ in SIZES]
    for frame in clip:
        for index, size in enumerate(SIZES):
            image, truth = frame.image, frame.truths[0]
            if size != SIZES[-1]:
                image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
                truth = cv2.resize(truth, size, interpolation=cv2.INTER_NEAREST)
            [result] = pipelines[index].update(image, frame.stamp_ns)
            times[index].append(dict(result.timings_ms))
            scores[index].append(score_frame(result.mask, None, truth).j)
    report: dict[str, Any] = {}
    for index, size in enumerate(SIZES):
        row: dict[str, float] = {
            stage: round(statistics.median(each[stage] for each in times[index]), 3)
            for stage in STAGES
        }
        row['mean'] = round(statistics.fmean(each['total'] for each in times[index]), 3)
        row['j'] = round(statistics.fmean(scores[index]), 4)
        report[f'{size[0]}x{size[1]}'] = row
    small, large = (report['{}x{}'.format(*size)] for size in (SIZES[0], SIZES[-1]))
    report['ratio'] = round(large['total'] / small['total'], 3)
    report['ratio_mean'] = round(large['mean'] / small['mean'], 3)
    return report


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--people', type=int, nargs='+', default=[300, 600], metavar='PX',
        help='heights of the walker at 1920 x 1080 (default: %(default)s)')  # fmt: skip
    add('--frames', type=int, default=40)
    add('--seed', type=int, default=0)
    add('--json', type=Path, metavar='FILE', help='write the figures here')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    compile_kernels()
    reports, fine = {}, True
    for person in options.people:
        report = measure(person, options.frames, options.seed)
        reports[str(person)] = report
        for size in SIZES:
            name = f'{size[0]}x{size[1]}'
            row = report[name]
            print(f'{person:5d} px {name:>9s}', *(f'{k} {v:7.3f}' for k, v in row.items()))
        holds = report['ratio'] <= MOST
        fine &= holds
        print(
            f'{"ok  " if holds else "MISS"} {SIZES[-1][0]} over {SIZES[0][0]}: '
            f'{report["ratio"]:.2f} <= {MOST:g} (means {report["ratio_mean"]:.2f})'
        )
    if options.json:
        options.json.write_text(json.dumps(reports, indent=1) + '\n')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('resolution.py', main))
