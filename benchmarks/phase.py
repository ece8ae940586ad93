#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Phase over time with the path and with independent frames, from the tracker's own likelihood.

Dressed walkers are drawn before a cluttered wall in many directions, sizes, cadences and frame
rates.  The pipeline is given their first box; the boxes and likelihoods that its tracker finds are
then matched in three ways: ``independent``, the best template of each frame alone; ``path``, the
template of the path; ``clock``, the phase that the matcher emits, a filter of this package's own
about the path.  A profile shows the same silhouette twice a stride, and seen from the front or
back walking towards and away look the same half a stride apart: phase errors are taken modulo half
a stride, and (``whole``) of the whole stride with the half chosen once a walk.  A step counts as
backward if the phase is less than the one before, by up to half a stride.  ``settled`` leaves out
the first second.

``--delays`` also lets results wait for later frames (``matching.lag``), up to the whole clip.
``--set matching.rate_cost=1`` changes parameters of the matching, not of what is tracked.
``--plots`` draws docs/images/phase_path.png (also of real clips, ``--clips SEQUENCE_DIR ...``),
phase_confidence.png and, with ``--delays``, phase_delay.png.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import overridden
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.results import MatchResult, TrackResult
from gait_tools.evaluation.report import aligned
from gait_tools.evaluation.sequence import Sequence
from gait_tools.gait_model import FIGURES

ROOT = Path(__file__).resolve().parents[1]
AZIMUTHS = (0, -20, 35, 60, 80, 90, 100, -85, 125, 150, 180, -135)  # degrees
WALKS = ((110.0, 0.95, 30.0), (60.0, 0.8, 15.0), (150.0, 1.15, 25.0))  # height, strides/s, fps
SIZE = (480, 320)
SECONDS = 3.0
NEAR_PROFILE = 60.0  # degrees within which a view counts as seen from the side
SETTLED = 1.0  # seconds
DELAYS = (0.0, 0.1, 0.2, 0.4, 0.8, 1.2, math.inf)  # seconds
WINDOW = '1.2'  # of them, that of the path: the paper's
WHOLE = 300  # frames, more than any walk has
KINDS = ('independent', 'path', 'clock')


@dataclass(frozen=True)
class Walk:
    """What the tracker made of a clip, and its truth."""

    tracks: list[TrackResult]
    size: tuple[int, int]
    fps: float = 0.0
    phases: tuple[float, ...] = ()
    azimuth: float = 0.0


def tracked(frames: Iterable[tuple[NDArray[np.uint8], int]], box: Box | None) -> list[TrackResult]:
    """Run the pipeline over images with stamps and return what its tracker says of the person."""
    pipeline = Pipeline()
    assert box is not None
    pipeline.initialize(box)
    return [
        result.people[0].track
        for image, stamp_ns in frames
        for result in pipeline.update(image, stamp_ns)
    ]


def walk(degrees: float, number: int, seed: int) -> Walk:
    """Draw and track a walker."""
    height, rate, fps = WALKS[number]
    clip = SyntheticSequence(
        SyntheticConfig(
            seed=seed,
            width=SIZE[0],
            height=SIZE[1],
            fps=fps,
            frames=round(SECONDS * fps),
            person_height=height,
            azimuth=math.radians(degrees),
            stride_rate=rate,
            build=FIGURES[seed % len(FIGURES)],
        )
    )
    frames = list(clip)
    return Walk(
        tracked(((frame.image, frame.stamp_ns) for frame in frames), frames[0].boxes[0]),
        SIZE,
        fps,
        tuple(frame.phases[0] for frame in frames),
        math.radians(degrees),
    )


def filmed(folder: Path) -> tuple[str, Walk]:
    """Track the person of a real clip, whose phase nobody knows."""
    clip = Sequence.load(folder)
    frames = ((clip.image(number), clip.stamp_ns(number)) for number in clip.numbers)
    return clip.name, Walk(tracked(frames, clip.initial_box), clip.size)


def match(matcher: SequenceMatcher, walk: Walk, *, independent: bool = False) -> list[MatchResult]:
    """Match the frames along a path, or each of them alone."""
    results = []
    matcher.reset()
    for track in walk.tracks:
        if independent:
            matcher.reset()
        results += matcher.update(
            track.likelihood,
            track.body,
            track.stamp_ns,
            track_id=track.track_id,
            source_size=walk.size,
            angle=track.angle,
        )
    return results + matcher.flush()


def phases_of(results: list[MatchResult], kind: str, count: int) -> NDArray[np.float64]:
    """Return the phases, NaN where nobody is tracked: the template's, or those emitted."""
    return np.array(
        [
            math.nan
            if result.body is None
            else result.phase
            if kind == 'clock'
            else result.phase_index / count
            for result in results
        ]
    )


def rms(errors: NDArray[np.float64]) -> float:
    """Return the root mean square in percent."""
    return 100 * float(np.sqrt(np.nanmean(errors**2)))


def backward(phases: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which steps go backwards."""
    return np.asarray((np.diff(phases) + 0.5) % 1.0 - 0.5 < -1e-6)


def errors(phases: NDArray[np.float64], walk: Walk) -> NDArray[np.float64]:
    """Return the phase errors in strides, modulo half a stride, in -0.25..0.25."""
    return np.asarray((phases - np.array(walk.phases) + 0.25) % 0.5 - 0.25)


def scores(results: list[MatchResult], kind: str, walk: Walk, count: int) -> dict[str, float]:
    """Score one way of matching a walk."""
    phases = phases_of(results, kind, count)
    error = errors(phases, walk)
    off_whole = phases - np.array(walk.phases)
    # Towards and away from the camera look alike.
    off = [abs(abs(result.azimuth) - abs(walk.azimuth)) for result in results]
    return {
        'rms_percent': rms(error),
        'whole_percent': min(rms((off_whole + flip) % 1.0 - 0.5) for flip in (0.0, 0.5)),
        'settled_percent': rms(error[round(SETTLED * walk.fps) :]),
        'backward_percent': 100 * float(backward(phases).mean()),
        'view_percent': 100 * float((np.array(off) <= math.pi / 8).mean()),
    }


def side(walk: Walk) -> bool:
    """Tell whether a walk is seen from the side."""
    return abs(math.cos(walk.azimuth)) >= math.cos(math.radians(NEAR_PROFILE)) - 1e-9


def summary(walks: list[Walk], rows: list[dict[str, dict[str, float]]]) -> dict[str, Any]:
    """Average over the walks seen from the side, and from front and back."""
    result: dict[str, Any] = {}
    for name, wanted in (('side', True), ('front', False)):
        chosen = [row for each, row in zip(walks, rows, strict=True) if side(each) == wanted]
        result[name] = {
            kind: {
                key: round(float(np.mean([row[kind][key] for row in chosen])), 3)
                for key in chosen[0][kind]
            }
            for kind in chosen[0]
        }
    return result


def delayed(walks: list[Walk], config: MatchingConfig, count: int) -> dict[str, Any]:
    """Match with results that wait for later frames; delay in seconds -> scores."""
    found = {}
    for delay in DELAYS:
        rows = []
        for each in walks:
            lag = WHOLE if math.isinf(delay) else round(delay * each.fps)
            matcher = SequenceMatcher(default_bank(), dataclasses.replace(config, lag=lag))
            results = match(matcher, each)
            rows.append({kind: scores(results, kind, each, count) for kind in KINDS[1:]})
        found['whole clip' if math.isinf(delay) else f'{delay:g}'] = summary(walks, rows)
    return found


def reliability(trust: Iterable[tuple[float, bool]]) -> list[dict[str, float]]:
    """Compare the confidence with the share of right phases, in bins."""
    values, right = (np.array(each) for each in zip(*trust, strict=True))
    bins = np.clip((values * 8).astype(int), 0, 7)
    return [
        {
            'confidence': round(float(values[bins == k].mean()), 3),
            'right': round(float(right[bins == k].mean()), 3),
            'frames': int((bins == k).sum()),
        }
        for k in range(8)
        if (bins == k).sum() >= 20
    ]


def draw_phases(axis: Any, walk: Walk, phases: NDArray[np.float64], title: str) -> None:
    """Draw the phases of a walk over those that are true."""
    seconds = np.array([track.stamp_ns for track in walk.tracks]) / 1e9
    if walk.phases:
        # The half of the stride is a free choice in profile: shown as chosen.
        off = (phases[len(phases) // 2] - walk.phases[len(phases) // 2] + 0.5) % 1 - 0.5
        flip = 0.5 if abs(off) > 0.25 else 0.0
        truth = (np.array(walk.phases) + flip) % 1
        axis.plot(seconds - seconds[0], truth, '.', color='0.75', ms=7)
    axis.plot(seconds - seconds[0], phases, '.', ms=3, color='C0')
    axis.set_title(f'{title}, {100 * backward(phases).mean():.0f} % back', fontsize=7)
    axis.tick_params(labelsize=7)


def draw(report: dict[str, Any], shown: dict[str, Walk], matcher: SequenceMatcher) -> None:
    """Draw the figures of the docs."""
    import matplotlib

    matplotlib.use('Agg')
    import matplotlib.pyplot as plt

    images, count = ROOT / 'docs' / 'images', default_bank().phases
    figure, axes = plt.subplots(
        len(shown), 3, figsize=(8.4, 1.6 * len(shown)), sharex='row', sharey=True, squeeze=False
    )
    for (title, each), row in zip(shown.items(), axes, strict=True):
        for axis, kind in zip(row, KINDS, strict=True):
            results = match(matcher, each, independent=kind == 'independent')
            draw_phases(axis, each, phases_of(results, kind, count), f'{title}: {kind}')
        row[0].set_ylabel('phase', fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel('s', fontsize=8)
    figure.tight_layout()
    figure.savefig(images / 'phase_path.png', dpi=75)
    figure, axis = plt.subplots(figsize=(3.2, 3))
    axis.plot([0, 1], [0, 1], color='0.8')
    bins = report['reliability']
    axis.plot([b['confidence'] for b in bins], [b['right'] for b in bins], 'o-')
    axis.set_xlabel('confidence')
    axis.set_ylabel('phase right to 5 %')
    figure.tight_layout()
    figure.savefig(images / 'phase_confidence.png', dpi=80)
    if 'delays' not in report:
        return
    figure, axis = plt.subplots(figsize=(4.6, 3.2))
    for view, style in (('side', '-'), ('front', '--')):
        for kind, colour in (('path', 'C0'), ('clock', 'C1')):
            values = [each[view][kind]['rms_percent'] for each in report['delays'].values()]
            axis.plot(values, 'o' + style, ms=3, color=colour, label=f'{kind}, {view}')
    axis.set_xticks(range(len(DELAYS)), list(report['delays']), fontsize=7)
    axis.set_xlabel('delay in s')
    axis.set_ylabel('phase RMS, % of a stride')
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(images / 'phase_delay.png', dpi=80)


def main() -> int:
    """Measure, print, and say whether what is promised with --delays holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--json', type=Path, help='write the figures here')
    parser.add_argument('--plots', action='store_true', help='draw the figures of the docs')
    parser.add_argument('--delays', action='store_true', help='also with results that wait')
    parser.add_argument(
        '--clips', type=Path, nargs='+', default=[], metavar='DIR', help='sequences for --plots'
    )
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--set', action='append', default=[], metavar='matching.PARAM=VALUE')
    arguments = parser.parse_args()
    config = overridden(PipelineConfig(), arguments.set).matching
    cv2.setNumThreads(1)
    compile_kernels()
    bank = default_bank()
    matcher = SequenceMatcher(bank, config)
    walks = [
        walk(degrees, number, 100 * arguments.seed + len(WALKS) * place + number)
        for place, degrees in enumerate(AZIMUTHS)
        for number in range(len(WALKS))
    ]
    rows, trust = [], []
    for each in walks:
        results = match(matcher, each)
        found = {'independent': match(matcher, each, independent=True)}
        found |= dict.fromkeys(KINDS[1:], results)
        rows.append({kind: scores(found[kind], kind, each, bank.phases) for kind in KINDS})
        wrong = errors(phases_of(results, 'clock', bank.phases), each)
        trust += [
            (result.confidence, abs(error) <= 0.05)
            for result, error in zip(results, wrong, strict=True)
            if result.body is not None
        ]
    report = {**summary(walks, rows), 'reliability': reliability(trust), 'walks': rows}
    table = [['view', 'phase', 'RMS %', 'whole RMS %', 'settled %', 'back %', 'view right %']]
    for name in ('side', 'front'):
        for kind, values in report[name].items():
            table.append([name, kind, *(f'{value:.2f}' for value in values.values())])
    print(aligned(table))
    for entry in report['reliability']:
        print(entry)
    if arguments.delays:
        report['delays'] = delayed(walks, config, bank.phases)
        table = [['delay s', 'view', 'path RMS %', 'clock RMS %']]
        for delay, views in report['delays'].items():
            for name, values in views.items():
                errors_of = (values[kind]['rms_percent'] for kind in KINDS[1:])
                table.append([delay, name, *(f'{error:.2f}' for error in errors_of)])
        print(aligned(table))
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + '\n')
    if arguments.plots:
        shown = {'side': walks[0], 'front': walks[len(WALKS) * AZIMUTHS.index(90)]}
        shown.update(filmed(folder) for folder in arguments.clips)
        draw(report, shown, matcher)
    fine = True
    for name in ('side', 'front'):
        without = report[name]['independent']['rms_percent']
        for kind, key in itertools.product(KINDS[1:], ('rms_percent', 'whole_percent')):
            ratio = report[name]['independent'][key] / report[name][kind][key]
            print(f'{name}, {key}: without over with {kind} {ratio:.2f}')
        if arguments.delays:
            ratio = without / report['delays'][WINDOW][name]['clock']['rms_percent']
            what = f'RMS without over with clock, {WINDOW} s later, {name}'
            fine &= holds(what, ratio, 2.0, least=True)
    if arguments.delays:
        ratio = report['side']['independent']['rms_percent']
        ratio /= report['delays'][WINDOW]['side']['path']['rms_percent']
        fine &= holds(
            f'RMS without over with path, {WINDOW} s later, side', ratio, 2.0, least=True
        )
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('phase.py', main))
