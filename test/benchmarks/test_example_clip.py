# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The clip that ships is what the benchmark makes, is small, and can be scored."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks import example_clip
from gait_tools.cli.evaluate import main
from gait_tools.evaluation.sequence import Sequence

SHIPPED = Path(__file__).parents[2] / 'examples/walker'
LARGEST = 300_000  # bytes


def test_it_is_what_is_made_and_small(tmp_path: Path) -> None:
    example_clip.write(tmp_path)
    files = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob('*.*'))
    shipped = [path for path in SHIPPED.rglob('*.*') if path.name != 'README.md']
    assert files == sorted(path.relative_to(SHIPPED) for path in shipped)
    assert sum(path.stat().st_size for path in shipped) < LARGEST
    about = 'sequence.yaml'
    assert (SHIPPED / about).read_text() == (tmp_path / about).read_text()
    made, there = Sequence.load(tmp_path), Sequence.load(SHIPPED)
    for number in made.numbers:
        truth = there.truth(number)
        assert truth is not None
        assert np.array_equal(truth, made.truth(number))
        # Other versions of OpenCV may code JPEG a little differently.
        assert cv2.absdiff(there.image(number), made.image(number)).mean() < 1


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
