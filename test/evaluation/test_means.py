# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import pytest

from gait_segmentation.evaluation.means import mean_known, mean_tracking


def test_what_is_missing_does_not_count() -> None:
    assert mean_known([1.0, None, 2.0, math.nan]) == pytest.approx(1.5)
    assert mean_known([None, math.nan]) is None


def _row(**other: object) -> dict[str, object]:
    counts = ('lost_frames', 'id_switches', 'shared_ids', 'false_slots', 'false_frames')
    row: dict[str, object] = dict.fromkeys((*counts, 'never_locked', 'never_recovered'), 1)
    row |= {'J': 0.5, 'J_one_id': 0.4, 'box_iou': None, 'centre_error': 0.1}
    return row | {'lock_seconds': 0.2, 'recovery_seconds': None} | other


def test_counts_are_summed_and_the_longest_of_times_is_taken() -> None:
    mean = mean_tracking([_row(), _row(J=1.0, lock_seconds=0.7, box_iou=0.6)])
    assert mean['J'] == pytest.approx(0.75)
    assert mean['box_iou'] == pytest.approx(0.6)
    assert mean['false_slots'] == 2
    assert mean['lock_seconds'] == 0.7
    assert mean['recovery_seconds'] is None


def test_what_a_sequence_has_not_measured_has_no_mean() -> None:
    assert 'mota' not in mean_tracking([_row(mota=0.9), _row()])
    assert mean_tracking([_row(mota=0.9), _row(mota=0.7)])['mota'] == pytest.approx(0.8)
