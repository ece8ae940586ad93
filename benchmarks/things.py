#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Tell which things that are no people keep a slot for more than a second: synthetic ones, and films.

``python benchmarks/things.py [--seeds 3] [--without DIR]``; ``DIR`` is a folder of films that show
nobody.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.synthetic.things import THINGS, ThingClip
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline

KEPT_NS = 1_000_000_000


def keeps_a_slot(frames: Iterable[tuple[NDArray[np.uint8], int]]) -> bool:
    """Return whether anything is one track for long; frames are BGR images with stamps in ns."""
    pipeline, since = Pipeline(), dict[int, int]()
    for image, stamp_ns in frames:
        for result in pipeline.update(image, stamp_ns):
            number = result.people[0].track.track_id
            if number and stamp_ns - since.setdefault(number, stamp_ns) > KEPT_NS:
                return True
    return False


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--seeds', type=int, default=3, help='clips of each kind of thing')
    parser.add_argument('--without', type=Path, help='folder of films that show nobody')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    seeds = range(options.seeds, 2 * options.seeds)
    clips = {f'{name} {seed}': ThingClip(name, seed) for name in THINGS for seed in seeds}
    kept = [name for name, clip in clips.items() if keeps_a_slot(clip)]
    films = sorted(options.without.iterdir()) if options.without else []
    for path in films:
        shown = open_input(path).frames()
        frames = ((each.image, each.stamp_ns) for each in shown if each.image is not None)
        kept += [path.name] * keeps_a_slot(frames)
    print(f'{len(kept)} of {len(clips) + len(films)} keep a slot: {", ".join(kept)}')


if __name__ == '__main__':
    sys.exit(run_tool('things.py', main))
