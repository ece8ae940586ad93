# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over people and over sequences, of scores that may be missing."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Mapping
from typing import Any

__all__ = ['mean_known', 'mean_tracking']

_SUMMED = (
    'lost_frames',
    'id_switches',
    'shared_ids',
    'false_slots',
    'false_frames',
    'never_locked',
    'never_recovered',
)

_AVERAGED = ('J', 'J_one_id', 'box_iou', 'centre_error', 'mota', 'idf1')

_WORST = ('lock_seconds', 'recovery_seconds')


def mean_known(values: Iterable[float | None]) -> float | None:
    """Return the mean of the values that are neither None nor NaN, None without any."""
    known = [value for value in values if value is not None and not math.isnan(value)]
    return statistics.fmean(known) if known else None


def mean_tracking(rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Put the scores of sequences together: means, sums of counts, the longest of times."""
    rows = list(rows)
    mean: dict[str, Any] = {name: sum(row[name] for row in rows) for name in _SUMMED}
    for name in _AVERAGED:
        if all(name in row for row in rows):
            mean[name] = mean_known(row[name] for row in rows)
    for name in _WORST:
        times = [row[name] for row in rows if row[name] is not None]
        mean[name] = max(times, default=None)
    return mean
