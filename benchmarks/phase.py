#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Phase over time with the path and with independent frames.

Walkers are drawn at many directions, sizes, cadences and frame rates.  Their likelihood is the
true silhouette with 20 % of the pixels turned over and 10 % of the area missing in blocks; the
tight box jitters by 1 % of the height.  Phase errors are taken modulo half a stride throughout,
because a profile shows the same silhouette twice a stride, and seen from the front or back
walking towards and away look the same half a stride apart.  A step counts as backward if the
phase emitted is less than the one before, by up to half a stride.  ``settled`` leaves out the
first second, in which the phase has to be found.  ``independent`` is the best template of each
frame alone.

``--plots`` draws docs/images/phase_path.png and phase_confidence.png, the first also of real
clips (``--clips SEQUENCE_DIR ...``) by their true masks, treated in the same way.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.gait_model import default_bank
from gait_segmentation.gait_model.render import render_silhouette
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.results import MatchResult

ROOT = Path(__file__).resolve().parents[1]
AZIMUTHS = (0, -20, 35, 60, 80, 90, 100, -85, 125, 150, 180, -135)  # degrees
WALKS = ((110.0, 0.95, 30.0), (60.0, 0.8, 15.0), (150.0, 1.15, 25.0))  # height, strides/s, fps
SECONDS = 3.0
NEAR_PROFILE = 60.0  # degrees within which a view counts as seen from the side
SETTLED = 1.0  # seconds
GOALS = {'rms_percent': 2.0, 'backward_percent': 1.0, 'view_percent': 95.0}


@dataclass(frozen=True)
class Frame:
    """One frame of a walk: likelihood, box, and the true phase, NaN if unknown."""

    stamp_ns: int
    likelihood: NDArray[np.uint8]
    box: Box
    phase: float


def spoil(mask: NDArray[np.uint8], height: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Turn 20 % of the pixels over and blacken blocks of 10 % of the area."""
    result = mask.copy()
    side = max(2, round(0.1 * height))
    for _ in range(round(0.1 * mask.size / side**2)):
        y, x = rng.integers(0, mask.shape[0] - side), rng.integers(0, mask.shape[1] - side)
        result[y : y + side, x : x + side] = 0
    return np.where(rng.random(mask.shape) < 0.2, 255 - result, result).astype(np.uint8)


def jitter(box: Box, rng: np.random.Generator) -> Box:
    """Move the edges of a box by about 1 % of its height."""
    dx, dy, dw, dh = rng.normal(0, 0.01 * box.height, 4)
    return Box(box.x + dx, box.y + dy, box.width + dw, box.height + dh)


def walk(
    azimuth: float, height: float, rate: float, fps: float, rng: np.random.Generator
) -> Iterator[Frame]:
    """Draw a walker whom the camera follows."""
    size = (round(1.6 * height), round(1.6 * height))
    start = rng.random()
    for number in range(round(SECONDS * fps)):
        seconds = number / fps
        phase = (start + rate * seconds) % 1.0
        drawn = render_silhouette(phase, azimuth, height, shift=tuple(rng.random(2)))
        y, x = (size[0] - drawn.shape[0]) // 2, (size[1] - drawn.shape[1]) // 2
        mask = np.zeros(size, np.uint8)
        mask[y : y + drawn.shape[0], x : x + drawn.shape[1]] = drawn
        box = Box.around(mask > 127)
        assert box is not None
        stamp = 10**9 + round(seconds * 1e9)
        yield Frame(stamp, spoil(mask, height, rng), jitter(box, rng), near_leg(phase, azimuth))


def near_leg(phase: float, azimuth: float) -> float:
    """Return the phase that begins with the heel contact of the leg nearer to the camera."""
    return phase if math.cos(azimuth) > -1e-9 else (phase + 0.5) % 1.0


def clip(folder: Path, rng: np.random.Generator) -> Iterator[Frame]:
    """Return the frames of a real clip, with its spoilt true masks for likelihoods."""
    sequence = Sequence.load(folder)
    for number in sequence.numbers:
        truth = sequence.truth(number)
        if truth is None:
            continue
        mask = np.where(truth == 255, 255, 0).astype(np.uint8)
        box = Box.around(mask)
        if box is not None:
            stamp = 10**9 + sequence.stamp_ns(number)
            yield Frame(stamp, spoil(mask, box.height, rng), box, math.nan)


def match(matcher: SequenceMatcher, frames: list[Frame], independent: bool) -> list[MatchResult]:
    """Match the frames along a path, or each of them alone."""
    results = []
    matcher.reset()
    for frame in frames:
        if independent:
            matcher.reset()
        height, width = frame.likelihood.shape
        results += matcher.update(
            frame.likelihood, frame.box, frame.stamp_ns, track_id=1, source_size=(width, height)
        )
    return results + matcher.flush()


def errors(results: list[MatchResult], frames: list[Frame]) -> NDArray[np.float64]:
    """Return the phase errors in strides, modulo half a stride, in -0.25..0.25."""
    pairs = zip(results, frames, strict=True)
    off = np.array([result.phase - frame.phase for result, frame in pairs])
    return np.asarray((off + 0.25) % 0.5 - 0.25)


def backward(results: list[MatchResult]) -> NDArray[np.bool_]:
    """Tell which steps go backwards."""
    steps = np.diff([result.phase for result in results])
    return np.asarray((steps + 0.5) % 1.0 - 0.5 < -1e-6)


def view_right(results: list[MatchResult], azimuth: float, bins: int) -> NDArray[np.bool_]:
    """Tell where the view is right to one bin, towards and away from the camera alike."""
    off = [abs(abs(result.azimuth) - abs(azimuth)) for result in results]
    return np.asarray(np.array(off) <= 2 * math.pi / bins)


def measure(matcher: SequenceMatcher, seed: int) -> dict[str, Any]:
    """Match all walks."""
    rng = np.random.default_rng(seed)
    rows, trust = [], []
    for degrees in AZIMUTHS:
        azimuth = math.radians(degrees)
        for height, rate, fps in WALKS:
            frames = list(walk(azimuth, height, rate, fps, rng))
            both = {}
            for kind in ('path', 'independent'):
                results = match(matcher, frames, kind == 'independent')
                error = errors(results, frames)
                settled = error[round(SETTLED * fps) :]
                both[kind] = {
                    'rms_percent': 100 * float(np.sqrt(np.mean(error**2))),
                    'settled_percent': 100 * float(np.sqrt(np.mean(settled**2))),
                    'backward_percent': 100 * float(backward(results).mean()),
                    'view_percent': 100 * float(view_right(results, azimuth, 16).mean()),
                }
                if kind == 'path':
                    right = np.abs(error) <= 0.05
                    trust += [
                        (result.confidence, bool(r))
                        for result, r in zip(results, right, strict=True)
                    ]
            off_profile = min(abs(degrees), 180 - abs(degrees))
            rows.append({'azimuth_deg': degrees, 'off_profile_deg': off_profile, 'height': height,
                         'fps': fps, **both})  # fmt: skip
    return {'walks': rows, 'trust': trust}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Average over the walks seen from the side and the others."""
    result: dict[str, Any] = {}
    for name, side in (('side', True), ('front', False)):
        chosen = [row for row in rows if (row['off_profile_deg'] <= NEAR_PROFILE) == side]
        result[name] = {
            kind: {
                key: round(float(np.mean([row[kind][key] for row in chosen])), 3)
                for key in chosen[0][kind]
            }
            for kind in ('path', 'independent')
        }
    return result


def reliability(trust: list[tuple[float, bool]]) -> list[dict[str, float]]:
    """Compare the confidence with the share of right phases, in bins."""
    values = np.array([value for value, _ in trust])
    right = np.array([is_right for _, is_right in trust])
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


def draw(
    matcher: SequenceMatcher, bins: list[dict[str, float]], seed: int, clips: list[Path]
) -> None:
    """Draw both figures."""
    import matplotlib

    matplotlib.use('Agg')
    import matplotlib.pyplot as plt

    rng = np.random.default_rng(seed)
    shown = {'synthetic walk': list(walk(0.0, 110.0, 0.95, 30.0, rng))}
    for folder in clips:
        shown[f'{folder.resolve().name} (true masks, spoilt)'] = list(clip(folder, rng))
    figure, axes = plt.subplots(
        len(shown), 2, figsize=(8, 1.9 * len(shown)), sharex='row', sharey=True, squeeze=False
    )
    for (title, frames), (left, right) in zip(shown.items(), axes, strict=True):
        seconds = [(frame.stamp_ns - frames[0].stamp_ns) / 1e9 for frame in frames]
        for axis, kind in ((left, 'path'), (right, 'independent frames')):
            results = match(matcher, frames, kind != 'path')
            if not math.isnan(frames[0].phase):
                # The half of the stride is a free choice in profile: shown as chosen.
                first = results[len(results) // 2].phase - frames[len(frames) // 2].phase
                flip = 0.5 if abs((first + 0.5) % 1 - 0.5) > 0.25 else 0.0
                truth = [(frame.phase + flip) % 1 for frame in frames]
                axis.plot(seconds, truth, '.', color='0.75', ms=7)
            axis.plot(seconds, [result.phase for result in results], '.', ms=3, color='C0')
            back = 100 * backward(results).mean()
            axis.set_title(f'{title}: {kind}, {back:.0f} % back', fontsize=8)
            axis.tick_params(labelsize=7)
        left.set_ylabel('phase', fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel('s', fontsize=8)
    figure.tight_layout()
    figure.savefig(ROOT / 'docs' / 'images' / 'phase_path.png', dpi=80)
    figure, axis = plt.subplots(figsize=(3.2, 3))
    axis.plot([0, 1], [0, 1], color='0.8')
    axis.plot([b['confidence'] for b in bins], [b['right'] for b in bins], 'o-')
    axis.set_xlabel('confidence')
    axis.set_ylabel('phase right to 5 %')
    figure.tight_layout()
    figure.savefig(ROOT / 'docs' / 'images' / 'phase_confidence.png', dpi=80)


def main() -> int:
    """Measure, print, and say whether the goals are reached."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--json', type=Path, help='write the figures here')
    parser.add_argument('--plots', action='store_true', help='draw the figures of the docs')
    parser.add_argument(
        '--clips', type=Path, nargs='+', default=[], metavar='DIR', help='sequences for --plots'
    )
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--lag', type=int, default=0, help='frames of lag')
    arguments = parser.parse_args()
    matcher = SequenceMatcher(default_bank(), MatchingConfig(lag=arguments.lag))
    found = measure(matcher, arguments.seed)
    bins = reliability(found['trust'])
    report = {**summary(found['walks']), 'reliability': bins, 'walks': found['walks']}
    for name in ('side', 'front'):
        for kind in ('path', 'independent'):
            print(name, kind, report[name][kind])
    for entry in bins:
        print(entry)
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + '\n')
    if arguments.plots:
        draw(matcher, bins, arguments.seed, arguments.clips)
    missed = [
        f'{name} {key} {found[key]:g}, goal {GOALS[key]:g}'
        for name in ('side', 'front')
        for found in [report[name]['path']]
        for key in GOALS
        if (found[key] < GOALS[key] if key == 'view_percent' else found[key] > GOALS[key])
    ]
    print('goals missed: ' + '; '.join(missed) if missed else 'goals reached')
    return 1 if missed else 0


if __name__ == '__main__':
    sys.exit(run_tool('phase.py', main))
