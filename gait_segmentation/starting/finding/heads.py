# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People who touch, told apart by their heads: peaks of the upper outline with a gap between."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

__all__ = ['columns_of_people']

_LEAST_HEIGHT = 36
"""Height in pixels from which heads can be told."""

_LEAST_ASPECT = 0.5
"""Width over height from which there may be two."""

_HIGH, _DEEP = 0.25, 0.18
"""How low a head may be below the highest one, and how deep the gap between two, in heights."""

_APART = 0.3
"""Least distance of two heads, in heights."""


def columns_of_people(part: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """
    Return the columns of each of the people in a part, from left to right.

    :param part: (h, w) bool, true on what hangs together, with something in the outer rows and
        columns.
    :returns: first column and the one after the last; all columns if there is but one head.
    """
    height, width = part.shape
    if height < _LEAST_HEIGHT or width < _LEAST_ASPECT * height:
        return [(0, width)]
    top = np.where(part.any(axis=0), part.argmax(axis=0), height)
    heads: list[int] = []
    cuts: list[int] = []
    order = np.argsort(top, kind='stable')
    for column in order[top[order] <= _HIGH * height].tolist():
        gaps = [_gap(top, column, head, height) for head in heads]
        if all(gap is not None for gap in gaps):
            heads.append(column)
    heads.sort()
    for left, right in itertools.pairwise(heads):
        gap = _gap(top, left, right, height)
        assert gap is not None
        cuts.append(gap)
    bounds = [0, *cuts, width]
    return list(itertools.pairwise(bounds))


def _gap(top: NDArray[np.int64], one: int, two: int, height: int) -> int | None:
    """Return the middle of the gap between two heads, None if there is none."""
    left, right = min(one, two), max(one, two)
    if right - left < _APART * height:
        return None
    between = top[left : right + 1]
    lowest = int(between.max())
    if lowest - max(int(top[left]), int(top[right])) < _DEEP * height:
        return None
    return left + round(float(np.flatnonzero(between == lowest).mean()))
