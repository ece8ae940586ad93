# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The clip that ships is what the gait model draws, is small, and can be scored."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_tools.cli.evaluate import main
from gait_tools.evaluation.sequence import Sequence

SHIPPED = Path(__file__).parents[2] / 'examples/walker'
LARGEST = 300_000  # bytes
CLIP = SyntheticConfig(
    seed=1,
    width=256,
    height=192,
    fps=20.0,
    frames=36,
    person_height=110.0,
    stride_rate=0.95,
    noise=2.0,
)


def test_it_is_what_is_drawn_and_small() -> None:
    files = [path for path in SHIPPED.rglob('*.*') if path.name != 'README.md']
    assert sum(path.stat().st_size for path in files) < LARGEST
    drawn, there = SyntheticSequence(CLIP), Sequence.load(SHIPPED)
    assert (there.numbers, there.fps, there.initial_box) == (
        list(range(CLIP.frames)),
        CLIP.fps,
        drawn.initial_box,
    )
    phases = yaml.safe_load((SHIPPED / 'sequence.yaml').read_text())['phases']
    for frame in drawn:
        assert np.array_equal(there.truth(frame.number), frame.truths[0])
        assert phases[frame.number] == pytest.approx(frame.phases[0], abs=1e-4)
        # JPEG of quality 80.
        assert cv2.absdiff(there.image(frame.number), frame.image).mean() < 4


@pytest.mark.parametrize(('options', 'least'), [([], 0.95), (['--preset', 'paper'], 0.8)])
def test_it_is_scored(options: list[str], least: float, tmp_path: Path) -> None:
    scores = tmp_path / 'scores.json'
    threads = cv2.getNumThreads()
    try:
        assert main([str(SHIPPED), '--json', str(scores), *options]) == 0
    finally:
        cv2.setNumThreads(threads)
    numbers = json.loads(scores.read_text())['sequences']['walker']
    assert numbers['frames'] == 36
    assert numbers['J'] > least
    assert numbers['lost_frames'] == 0
