#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What a heat map is worth: good maps, and maps spoilt in every way that a robot may meet.

The maps are read from NAME/NNNN.png beside the frames of each sequence, as ``gait_evaluate
--heat-map NAME`` does, and spoilt: those of another sequence, mirrored, shifted by half a body,
inverted, constant, noise, of every third frame only, or three frames late, with the stamp of
their own frame or unsaid.  ``alone`` is without a map, and ``map`` the map itself above one half.
Prints J and the error rate in percent.  Usage::

    python benchmarks/heat_maps.py SEQUENCE_DIR ... [--heat-map NAME] [--rows ROW ...]
        [--init auto] [--set STAGE.PARAM=VALUE] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence as ListLike
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import overridden
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.images import shift_whole
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_tools.evaluation.metrics import FrameScore, score_frame
from gait_tools.evaluation.report import aligned
from gait_tools.evaluation.runner import heat_maps_of, run
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import load_sequences

GRADE = 200
"""Value of the constant map."""

HARMLESS = ('other', 'mirrored', 'shifted', 'inverted', 'constant', 'noise', 'late unsaid')
TIMED = {'every third': ':0:3', 'late': ':3', 'late unsaid': ':3'}
ROWS = ('alone', 'map', 'heat', *HARMLESS, 'every third', 'late')

Maps = Callable[[int], HeatMap | None]


def spoilt(row: str, sequence: Sequence, maps: Maps, others: Maps | None) -> Maps | None:
    """Return what gives the maps of a row, None if there are none."""
    width, height = sequence.size
    place = {number: index for index, number in enumerate(sequence.numbers)}
    box = sequence.initial_box
    half = round((height if box is None else box.height) / 2)

    def changed(number: int) -> HeatMap | None:
        heat = maps(number)
        other = others(place[number]) if row == 'other' and others is not None else heat
        if heat is None or other is None:
            return None
        stamp_ns = sequence.stamp_ns(number) if row == 'late unsaid' else heat.stamp_ns
        return HeatMap(_changed(row, other.values, number, half / width), stamp_ns)

    return None if row == 'alone' else changed


def _changed(row: str, values: NDArray[np.uint8], number: int, half: float) -> NDArray[np.uint8]:
    """
    Return the values of a map, (h, w) uint8, as in a row.

    :param half: of a body, over the width of the map.
    """
    if row == 'mirrored':
        return np.ascontiguousarray(values[:, ::-1])
    if row == 'shifted':
        return shift_whole(values, round(half * values.shape[1]), 0)
    if row == 'inverted':
        return 255 - values
    if row == 'constant':
        return np.full_like(values, GRADE)
    if row == 'noise':
        return np.random.default_rng(number).integers(0, 256, values.shape, np.uint8)
    return values


def of_place(sequence: Sequence, maps: Maps) -> Maps:
    """Return what gives the maps of a sequence by place, round and round."""
    return lambda place: maps(sequence.numbers[place % len(sequence.numbers)])


def measure(
    sequence: Sequence, row: str, config: PipelineConfig, given: Maps | None, *, auto: bool
) -> dict[str, float]:
    """Return mean J and error of a sequence, and the frames until somebody was found."""
    scores: list[FrameScore] = []
    if row == 'map' and given is not None:
        for number in sequence.numbers:
            truth, heat = sequence.truth(number), given(number)
            if truth is not None:
                values = np.zeros_like(truth) if heat is None else heat.values
                values = np.asarray(cv2.resize(values, sequence.size))
                found = np.where(values > 127, 255, 0).astype(np.uint8)
                scores.append(score_frame(found, None, truth))
    else:
        starts = {} if auto else sequence.starts
        outcomes = run(
            Pipeline(config),
            sequence,
            sequence.numbers,
            starts,
            clock=time.perf_counter,
            heat_map=given,
        )
        scores = [outcome.score for outcome in outcomes if outcome.score is not None]
    found_at = next((n for n, score in enumerate(scores) if score.j > 0.5), len(scores))
    return {
        'J': statistics.fmean(score.j for score in scores),
        'error': statistics.fmean(score.error_rate for score in scores),
        'found': found_at,
    }


def measure_row(
    row: str,
    sequences: ListLike[Sequence],
    name: str,
    config: PipelineConfig,
    *,
    auto: bool,
) -> dict[str, dict[str, float]]:
    """Return the figures of all sequences."""
    report = {}
    for index, sequence in enumerate(sequences):
        # Half way round the list, so that it is not a clip of the same film.
        other = sequences[(index + len(sequences) // 2) % len(sequences)]
        maps = heat_maps_of(sequence, name + TIMED.get(row, ''))
        others = heat_maps_of(other, name)
        assert maps is not None
        assert others is not None
        given = spoilt(row, sequence, maps, of_place(other, others))
        report[sequence.name] = measure(sequence, row, config, given, auto=auto)
    return report


def main() -> int:
    """Measure, print, and say whether wrong maps do no harm."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('sequence', type=Path, nargs='+', metavar='SEQUENCE_DIR')
    add('--heat-map', default='rvm', metavar='NAME', help='folder of the maps (%(default)s)')
    add('--rows', nargs='+', choices=ROWS, default=ROWS, metavar='ROW')
    add('--init', choices=('box', 'auto'), default='box')
    add('--set', action='append', default=[], metavar='STAGE.PARAM=VALUE')
    add('--json', type=Path, metavar='FILE', help='write the figures here')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    auto = options.init == 'auto'
    start = f'starting.auto_init={"motion" if auto else "none"}'
    config = overridden(PipelineConfig(), [start, *options.set])
    sequences = load_sequences(options.sequence, heat_map=options.heat_map)
    compile_kernels()
    report: dict[str, dict[str, dict[str, float]]] = {}
    for row in options.rows:
        found = measure_row(row, sequences, options.heat_map, config, auto=auto)
        report[row] = found
        mean = {key: statistics.fmean(v[key] for v in found.values()) for key in ('J', 'error')}
        at = statistics.median(v['found'] for v in found.values())
        print(f'{row}: J {mean["J"]:.4f}, error {mean["error"]:.2f} %, found {at:g}', flush=True)
    names = [each.name for each in sequences]
    table = [[name, *(f'{report[row][name]["J"]:.3f}' for row in report)] for name in names]
    print(aligned([['J', *report], *table]))
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + '\n')
    return 0 if all(_bars(report)) else 1


def _bars(report: dict[str, dict[str, dict[str, float]]]) -> list[bool]:
    """Print what is promised of the rows that were run, and return what holds."""
    mean = {row: statistics.fmean(v['J'] for v in found.values()) for row, found in report.items()}
    fine = []
    if {'alone', 'map', 'heat'} <= set(report):
        worst = min(
            each['J'] - max(report['alone'][name]['J'], report['map'][name]['J'])
            for name, each in report['heat'].items()
        )
        fine.append(
            holds('worst clip against the better of alone and map', worst, -0.01, least=True)
        )
    if 'heat' in report:
        for row, loss in (('every third', 0.005), ('late', 0.01)):
            if row in report:
                fine.append(holds(f'J lost, {row}', mean['heat'] - mean[row], loss))
    if 'alone' in report:
        for row in HARMLESS:
            if row in report:
                lost = mean['alone'] - mean[row]
                fine.append(holds(f'J lost against alone, {row}', lost, 0.01))
    return fine


if __name__ == '__main__':
    sys.exit(run_tool('heat_maps.py', main))
