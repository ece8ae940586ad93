# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A clip to be made harder."""

from __future__ import annotations

import numpy as np

from benchmarks.variants import MadeClip
from gait_tools.evaluation.metrics import start_box
from gait_tools.evaluation.truth import PERSON
from test import walkers


def clip_of(pan: float = 0.0, frames: int = 10, seed: int = 3) -> MadeClip:
    made = walkers.clip(pan, frames, seed)
    pairs = tuple((frame.image, frame.truths[0]) for frame in made)
    box = start_box(pairs[0][1])
    assert box is not None
    return MadeClip(f'walk{seed}', 25.0, pairs, box)


def size_of(truth: np.ndarray | None) -> int:
    assert truth is not None
    return int(np.count_nonzero(truth == PERSON))
