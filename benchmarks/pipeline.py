#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The pipeline in lockstep over varied clips: synthetic ones, or sequences with truth.

Without FOLDER the clips are synthetic: walkers of many directions, sizes, clothes and backgrounds,
and groups of two or three who cross, come and leave.  Each clip is run as it is and, with
``--kinds``, as worse cameras would have seen it or with heat maps, good and bad ones, made of its
truth (or those in ``--heat-map NAME`` beside its frames).  Prints the scores of every clip as
gait_evaluate does, the bars of clips as they are with what was measured, and of each kind mean
and worst J.  Further, by themselves::

    python benchmarks/pipeline.py [FOLDER ...] [--walkers 20] [--groups 10] [--init box auto]
        [--kinds dark map-late ...]
    python benchmarks/pipeline.py FOLDER ... --priors
    python benchmarks/pipeline.py --phases [--set matching.lag=12]
    python benchmarks/pipeline.py --places

``--priors`` compares the shape priors by themselves: likelihoods and matches are those of one run,
and every frame is cut again with each prior, so that no mask teaches the tracker anything; wrong
pixels in percent of the window.  ``--phases`` compares the phase with and without the path (the
paper's Fig. 4) on walkers in twelve directions, modulo half a stride and of the whole one:
``independent`` is the best template of each frame alone, ``path`` the template of the path,
``clock`` the phase that the matcher emits.  ``--places`` says how far off the localization is
before calibrated cameras, in metres.  ``--set`` changes a parameter of all that is run, and
``--json`` writes all numbers.
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks import holds
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import overridden, parameters_of, replaced
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.segmentation import PeopleSegmenter
from gait_tools.evaluation.metrics import error_percent, evaluation_window
from gait_tools.evaluation.report import aligned, tracking_table
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import Session, load_sequences
from gait_tools.evaluation.variants import KINDS, MAPS, TIMES, Variant
from gait_tools.figures.walk import Given, Shot, Walk, phases_of, record
from gait_tools.gait_model import FIGURES
from gait_tools.outputs import check_file, write_json

Numbers = dict[str, Any]

DIRECTIONS = (0.0, math.pi, 0.6, math.pi - 0.6, 1.4, -1.4)
"""Of the walkers, radians."""


AZIMUTHS = (0, -20, 35, 60, 80, 90, 100, -85, 125, 150, 180, -135)
"""Of the walkers whose phase is measured, degrees."""

WALKS = ((110.0, 0.95, 30.0), (60.0, 0.8, 15.0), (150.0, 1.15, 25.0))
"""Their heights in pixels, strides and frames a second."""


def made_clip(name: str) -> SyntheticSequence:
    """Make up a walker, or a group of two or three, by a name such as walker-3."""
    kind, _, number = name.partition('-')
    seed, alone = int(number), kind == 'walker'
    rng = np.random.default_rng([seed, 1])
    return SyntheticSequence(
        SyntheticConfig(
            seed=seed,
            frames=50 if alone else 100,
            azimuth=DIRECTIONS[seed % (len(DIRECTIONS) if alone else 4)],
            build=FIGURES[seed % len(FIGURES)],
            person_height=float(rng.uniform(60, 150)),
            pan=float(rng.choice([0.0, 0.0, 1.5, -1.5])),
            clutter=float(rng.uniform(0.2, 1.0)),
            shadow=bool(rng.random() < 0.3),
            stride_rate=float(rng.uniform(0.75, 1.05)),
            walkers=1 if alone else 2 + seed % 2,
        )
    )


def made_clips(options: argparse.Namespace, folder: Path) -> list[Sequence]:
    """Write the synthetic clips and open them."""
    names = [f'walker-{seed}' for seed in range(options.walkers)]
    names += [f'group-{seed}' for seed in range(options.groups)]
    for name in names:
        made_clip(name).write(folder / name)
    return load_sequences(folder / name for name in names)


def evaluated(
    sequences: list[Sequence], config: PipelineConfig, init: str, maps: str, fixed: Iterable[str]
) -> Numbers:
    """Run sequences as gait_evaluate does."""
    session = Session(
        sequences,
        lambda config: Pipeline(config, clock=time.process_time),
        time.perf_counter,
        auto=init == 'auto',
        heat_map=maps,
        fixed=frozenset(fixed),
    )
    return session.evaluate(config, name=init)


def bars_of(report: Numbers, init: str, synthetic: bool) -> Iterator[bool]:
    """Print what is promised of clips as they are, and yield whether it holds."""
    rows = {name: numbers['tracking'] for name, numbers in report['sequences'].items()}
    if synthetic and init == 'box':
        js = [scores['J'] for name, scores in rows.items() if name.startswith('walker-')] or [1.0]
        yield holds('walkers, mean J', statistics.fmean(js), 0.93, least=True)
        yield holds('walkers, worst J', min(js), 0.85, least=True)
    for name, scores in {} if synthetic else rows.items():
        if init == 'box':
            yield holds(f'{name}, lost frames', scores['lost_frames'], 0)
        else:
            late = math.inf if scores['never_locked'] else scores['lock_seconds'] or 0.0
            yield holds(f'{name}, seconds until found', late, 1.0)
            yield holds(f'{name}, false slots', scores['false_slots'], 0)


def vary(options: argparse.Namespace, config: PipelineConfig, root: Path) -> Numbers:
    """Run all clips in all kinds; print and return the scores and the bars."""
    fixed = [setting.partition('=')[0].strip() for setting in options.set]
    synthetic = not options.folders
    clips = made_clips(options, root) if synthetic else load_sequences(options.folders)
    report: Numbers = {'bars': []}
    rows = [['kind', 'init', 'clips', 'J', 'worst', 'clip']]
    for kind, init in itertools.product(options.kinds, options.init):
        maps = TIMES.get(kind, 'map') if kind in MAPS else ''
        chosen: list[Sequence] = [Variant.of(each, kind, options.heat_map) for each in clips]
        found = report[f'{kind} {init}'] = evaluated(chosen, config, init, maps, fixed)
        print(f'{kind}, init {init}\n{tracking_table(found)}\n', flush=True)
        if kind == 'plain':
            report['bars'] += bars_of(found, init, synthetic)
        js = {name: numbers['tracking']['J'] for name, numbers in found['sequences'].items()}
        worst = min(js, key=js.__getitem__)
        mean = statistics.fmean(js.values())
        rows.append([kind, init, str(len(js)), f'{mean:.4f}', f'{js[worst]:.4f}', worst])
    print(f'\n{aligned(rows)}')
    return report


def priors_of(sequence: Sequence, config: PipelineConfig, priors: Iterable[str]) -> list[float]:
    """Return the mean error of each prior on the likelihoods and matches of one run."""
    pipeline = Pipeline(config)
    segmenters = [
        PeopleSegmenter(replaced(config, 'segmentation', 'prior', prior).segmentation)
        for prior in priors
    ]
    errors: list[list[float]] = [[] for _ in segmenters]
    for number in sequence.numbers:
        for box in sequence.starts.get(number, ())[:1]:
            pipeline.initialize(box)
        image, truth = sequence.image(number), sequence.truth(number)
        (result,) = pipeline.update(image, sequence.stamp_ns(number))
        (person,) = result.people
        for segmenter, found in zip(segmenters, errors, strict=True):
            mask = segmenter.update(image, [person.track.likelihood], [person.match]).mask
            if truth is not None:
                window = evaluation_window(truth)
                found.append(error_percent(mask[window], truth[window]))
    return [statistics.fmean(each) for each in errors]


def compare_priors(folders: list[Path], config: PipelineConfig) -> Numbers:
    """Print and return the errors of all priors."""
    config = overridden(config, ['detector.network=none', 'people.max_people=1'])
    about = {each.name: each for each in parameters_of(config.segmentation)}['prior']
    priors = [str(each) for each in about.choices or ()]
    sequences = load_sequences(folders)
    found = {each.name: priors_of(each, config, priors) for each in sequences}
    found['mean'] = [statistics.fmean(each) for each in zip(*found.values(), strict=True)]
    rows = [[name, *(f'{error:.2f}' for error in errors)] for name, errors in found.items()]
    print(aligned([['error %', *priors], *rows]))
    plain = priors.index('none')
    for place, prior in enumerate(priors):
        if place != plain:
            lower = sum(found[each.name][place] < found[each.name][plain] for each in sequences)
            ratio = found['mean'][place] / found['mean'][plain]
            print(f'{prior}: lower than none on {lower} of {len(sequences)}, means {ratio:.3f}')
    return {name: dict(zip(priors, each, strict=True)) for name, each in found.items()}


def recorded(clip: SyntheticSequence, config: PipelineConfig) -> list[Shot]:
    """Return what the pipeline makes of a walker."""
    assert clip.initial_box is not None

    def frames() -> Iterator[Given]:
        for each in clip:
            yield Given(each.number, each.stamp_ns, each.image, each.truths[0], each.phases[0])

    return record(Pipeline(config), Walk('walker', clip.initial_box, frames))


def compare_phases(seed: int, used: PipelineConfig) -> Numbers:
    """Print and return how far off phases are, from the side and from front and back."""
    report: dict[tuple[str, str], list[list[float]]] = {}
    for place, degrees in enumerate(AZIMUTHS):
        for number, (height, rate, fps) in enumerate(WALKS):
            lot, frames = 100 * seed + len(WALKS) * place + number, round(3 * fps)
            way, build = math.radians(degrees), FIGURES[lot % len(FIGURES)]
            config = SyntheticConfig(lot, 480, 320, fps, frames, height, way, rate, build)
            shots = recorded(SyntheticSequence(config), used)
            phases = phases_of(shots, default_bank(), used.matching)
            matches = [shot.match for shot in shots]
            clock = np.array([math.nan if m.body is None else m.phase for m in matches])
            view = 'side' if abs(math.cos(math.radians(degrees))) > 0.499 else 'front'
            ways = {'independent': phases.alone, 'path': phases.path, 'clock': clock}
            for name, each in ways.items():
                half = ((each - phases.true) + 0.25) % 0.5 - 0.25
                of_half = 100 * float(np.sqrt(np.nanmean(half**2)))
                back = 100 * float(((np.diff(each) + 0.5) % 1.0 - 0.5 < -1e-6).mean())
                scores = [of_half, phases.rms(each), back]
                report.setdefault((view, name), []).append(scores)
    means = {key: np.mean(rows, axis=0).round(3).tolist() for key, rows in report.items()}
    table = [['view', 'phase', 'RMS %', 'of the whole stride', 'steps back %']]
    print(aligned([*table, *([*key, *(f'{v:.2f}' for v in row)] for key, row in means.items())]))
    return {' '.join(key): row for key, row in means.items()}


def find_places() -> None:
    """Print how far off people are located, by depth with 1 % of noise and by the ground."""
    from benchmarks.synthetic.perspective import CAMERAS, PATHS, film, locate

    for walk, (camera, (model, pose)) in itertools.product(PATHS, CAMERAS.items()):
        shots, pipeline = list(film(PATHS[walk], model, pose)), Pipeline()
        box = Box.around(shots[0].mask)
        assert box is not None
        pipeline.initialize(box)
        results = [each for shot in shots for each in pipeline.update(shot.image, shot.stamp_ns)]
        people = [result.people[0] for result in results]
        found = [
            (shot, person.match, person.segmentation.mask)
            for shot, person in zip(shots, people, strict=True)
        ]
        for name, noise in (('depth', 0.01), ('ground', None)):
            print(f'{walk:9} {camera:6} {name:7}', locate(found, camera, noise), flush=True)


def main() -> int:
    """Measure, print, and say whether the bars hold."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('folders', type=Path, nargs='*', metavar='FOLDER', help='sequences with truth')
    add('--walkers', type=int, default=20, metavar='N')
    add('--groups', type=int, default=10, metavar='N')
    add('--kinds', nargs='+', choices=KINDS, default=['plain'], metavar='KIND',
        help=', '.join(KINDS))  # fmt: skip
    add('--init', nargs='+', choices=['box', 'auto'], default=['box', 'auto'])
    add('--heat-map', default='', metavar='NAME', help='folder of heat maps beside the frames')
    add('--priors', action='store_true', help='compare the shape priors by themselves')
    add('--phases', action='store_true', help='compare the phase with and without the path')
    add('--seed', type=int, default=1, help='of --phases')
    add('--places', action='store_true', help='say how far off people are located')
    add('--set', action='append', default=[], metavar='STAGE.PARAM=VALUE')
    add('--json', type=Path, metavar='FILE', help='write all numbers to a file')
    options = parser.parse_args()
    if options.priors and not options.folders:
        parser.error('--priors needs sequences')
    cv2.setNumThreads(1)
    config = overridden(PipelineConfig(), options.set)
    # Before all that takes long.
    load_sequences(options.folders)
    if options.json is not None:
        check_file(options.json)
    compile_kernels()
    report: Numbers = {}
    if options.priors:
        report = compare_priors(options.folders, config)
    elif options.phases:
        report = compare_phases(options.seed, config)
    elif options.places:
        find_places()
    else:
        with tempfile.TemporaryDirectory() as scratch:
            report = vary(options, config, Path(scratch))
    if options.json is not None:
        write_json(options.json, report)
    return 0 if all(report.get('bars', ())) else 1


if __name__ == '__main__':
    sys.exit(run_tool('pipeline.py', main))
