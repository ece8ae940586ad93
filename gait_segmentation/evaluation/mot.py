# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""MOTA and IDF1 as the package motmetrics counts them; without it there are none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ['MISSING', 'MotFrame', 'has_motmetrics', 'mot_scores']

LEAST_IOU = 0.5
"""Boxes that overlap less are no match."""

MISSING = 'MOTA and IDF1 need the Python package motmetrics, which is not installed'


@dataclass(frozen=True)
class MotFrame:
    """One frame: the people, the track ids, and the (people, tracks) IoU of their boxes."""

    people: tuple[int, ...]
    ids: tuple[int, ...]
    iou: NDArray[np.float64]


def has_motmetrics() -> bool:
    """Return whether MOTA and IDF1 can be had."""
    try:
        import motmetrics  # noqa: F401
    except ImportError:
        return False
    return True


def mot_scores(frames: Sequence[MotFrame]) -> dict[str, float | None]:
    """
    Return ``mota`` (Bernardin and Stiefelhagen 2008) and ``idf1`` (Ristani et al. 2016).

    :returns: None for what is undefined because nobody is there; empty without motmetrics.
    """
    try:
        import motmetrics
    except ImportError:
        return {}
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for frame in frames:
        distance = np.where(frame.iou >= LEAST_IOU, 1 - frame.iou, np.nan)
        accumulator.update(list(frame.people), list(frame.ids), distance)
    if not any(frame.people for frame in frames):
        return {'mota': None, 'idf1': None}
    scores = motmetrics.metrics.create().compute(
        accumulator, metrics=['mota', 'idf1'], return_dataframe=False
    )
    return {name: float(scores[name]) for name in ('mota', 'idf1')}
