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
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.demo import play, prepare_environment, read_stamps, start_nodes
from gait_segmentation.cli.processes import ProcessGroup
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.evaluation.metrics import jaccard
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline

BAR = 0.02


def live(sequence: Sequence, box: Box) -> dict[int, np.ndarray]:
    """Return the masks that the nodes answer, by the position of the frame."""
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from gait_segmentation.cli.recorder import Recorder

    film = open_input(sequence.folder / 'frames')
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with (
            tempfile.TemporaryDirectory() as logs,
            ProcessGroup(os.environ, Path(logs)) as processes,
        ):
            start_nodes(processes, box)
            recorder = Recorder()
            try:
                play(processes, recorder, film, sequence.fps, Path(logs) / 'stamps.txt')
            finally:
                recorder.close()
            stamps = read_stamps(Path(logs) / 'stamps.txt')
    finally:
        rclpy.try_shutdown()
    found = ((number, recorder.records.get(stamp)) for number, stamp in stamps.items())
    return {
        number: record.mask
        for number, record in found
        if record is not None and record.packed is not None
    }


def lockstep(sequence: Sequence, box: Box) -> dict[int, np.ndarray]:
    """Return the masks of the pipeline, by the position of the frame."""
    pipeline = Pipeline()
    pipeline.initialize(box)
    masks = {}
    for place, number in enumerate(sequence.numbers):
        for result in pipeline.update(sequence.image(number), sequence.stamp_ns(number)):
            masks[place] = result.mask
    return masks


def score(sequence: Sequence, masks: dict[int, np.ndarray]) -> float:
    """Return the mean J over all frames with ground truth."""
    values = []
    for place, number in enumerate(sequence.numbers):
        truth = sequence.truth(number)
        if truth is not None:
            values.append(jaccard(masks.get(place, np.zeros_like(truth)), truth))
    return float(np.mean(values))


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('folders', type=Path, nargs='+', metavar='FOLDER')
    options = parser.parse_args()
    prepare_environment(os.environ)
    fine = True
    for folder in options.folders:
        sequence = Sequence.load(folder)
        boxes = sequence.starts.get(sequence.numbers[0], ())
        if len(boxes) != 1:
            print(f'{sequence.name}: needs one person, from the first frame on', file=sys.stderr)
            return 2
        (box,) = boxes
        masks = live(sequence, box)
        with_nodes, alone = score(sequence, masks), score(sequence, lockstep(sequence, box))
        holds = alone - with_nodes <= BAR
        fine &= holds
        print(
            f'{"ok  " if holds else "MISS"} {sequence.name}: live {with_nodes:.4f} '
            f'({len(masks)} of {len(sequence.numbers)} frames answered), lockstep {alone:.4f}',
            flush=True,
        )
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('live.py', main))
