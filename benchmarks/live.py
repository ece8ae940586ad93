#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What is lost by working live: sequences through the three nodes against the pipeline in lockstep.

Every sequence is played by gait_source at its own rate into tracker, matcher and segmenter, which
are processes of their own, and the masks that come are scored with J.  A frame without a mask
counts as nobody seen.  Live, feedback comes some frames later than in lockstep.  Needs ROS 2 and
sequences with ground truth; leave the machine alone meanwhile::

    python benchmarks/live.py FOLDER [FOLDER ...]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from gait_segmentation.cli.live import play
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline
from gait_tools.evaluation.metrics import jaccard
from gait_tools.evaluation.runner import run
from gait_tools.evaluation.sequence import Sequence

BAR = 0.02


def live(sequence: Sequence, box: Box) -> dict[int, np.ndarray]:
    """Return the masks that the nodes answer, by the number of the frame."""
    film = open_input(sequence.folder / 'frames')
    with tempfile.TemporaryDirectory() as logs:
        recording = play(film, Path(logs), box=box, rate=sequence.fps)
    answered = recording.answered()
    return {sequence.numbers[each]: recording.result(each).mask for each in answered}


def score(sequence: Sequence, masks: dict[int, np.ndarray]) -> float:
    """Return the mean J over all frames with ground truth."""
    truths = {n: truth for n in sequence.numbers if (truth := sequence.truth(n)) is not None}
    values = [jaccard(masks.get(n, np.zeros_like(each)), each) for n, each in truths.items()]
    return float(np.mean(values))


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('folders', type=Path, nargs='+', metavar='FOLDER')
    options = parser.parse_args()
    fine = True
    for folder in options.folders:
        sequence = Sequence.load(folder)
        boxes = sequence.starts.get(sequence.numbers[0], ())
        if len(boxes) != 1:
            print(f'{sequence.name}: needs one person, from the first frame on', file=sys.stderr)
            return 2
        outcomes = run(Pipeline(), sequence, sequence.numbers, boxes[0], clock=time.perf_counter)
        alone = score(sequence, {each.number: each.mask for each in outcomes})
        masks = live(sequence, boxes[0])
        more = f'(lockstep {alone:.4f}, {len(masks)} of {len(sequence.numbers)} frames answered)'
        fine &= holds(
            f'{sequence.name}, live', score(sequence, masks), alone - BAR, least=True, more=more
        )
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('live.py', main))
