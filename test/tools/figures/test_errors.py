# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import numpy as np

from gait_tools.figures.errors import draw_errors, errors_of, errors_table

from .shots import short


def test_ambiguous_pixels_count_nothing():
    shots = []
    for shot in short()[:2]:
        truth = shot.given.truth
        mask = np.where((truth == 255) | (truth == 170), 255, 0).astype(np.uint8)
        shots.append(replace(shot, mask=mask))
    errors = errors_of(shots)
    assert errors is not None
    assert list(errors.percent) == [0, 1]
    assert errors.mean == 0
    assert errors.mean_j == 1


def test_errors_are_tabulated_and_drawn():
    errors = errors_of(short())
    assert errors is not None
    empty = errors_of([replace(shot, mask=np.zeros_like(shot.mask)) for shot in short()])
    assert empty is not None
    assert empty.mean > errors.mean
    rows = errors_table('short', empty, errors).splitlines()
    assert rows[2].startswith(f'| short | 8 | {empty.mean:.2f} % / 0.000 | {errors.mean:.2f} % / ')
    assert (draw_errors(empty, errors) != 255).any()


def test_without_truth_there_are_none():
    assert errors_of([replace(s, given=s.given._replace(truth=None)) for s in short()]) is None
