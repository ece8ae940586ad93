# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Changes of the camera's tone curve, undone.

Cameras bend their tone curve from frame to frame: shadows deepen while lights stay as they are.
Everything then differs from the remembered background, dark stripes most.  The difference of a
pixel depends on its lightness alone, so that the curve can be read off the surroundings.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.tracking.background.kernels import SURE_COUNT

__all__ = ['tone_curve']

_STEP = 2
_LEVELS = 16
_WIDE = 256 // _LEVELS
_MOST = 48
"""Largest difference in lightness that is a change of tone."""

_LEAST_PIXELS, _LEAST_OF_LEVEL = 300, 40
_MOST_LEFT = 0.75
"""Share of the differences that may be left when a change of tone has been undone."""

_LEAST_CHANGE = 2.0
"""Mean change in grey levels from which it is undone; learning follows what is less."""

_GRAY = np.arange(256, dtype=np.uint8)
_LIGHTNESS = cv2.cvtColor(np.repeat(_GRAY[None, :, None], 3, axis=2), cv2.COLOR_BGR2Lab)[
    0, :, 0
].astype(np.float64)
"""Lightness of the grey levels."""


@njit(cache=True, nogil=True, error_model='numpy')
def _count(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    people: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    out: NDArray[np.int64],
) -> None:
    """
    Count differences by level.

    The level is the mean of both lightnesses: with that of only one, noise and edges that are
    not quite in place would look like a loss of contrast.
    """
    seen = np.float32(SURE_COUNT)
    for row in range(top, bottom, _STEP):
        line, pixels, hidden = sums[row].reshape(-1), lab[row].reshape(-1), people[row]
        for col in range(left, right, _STEP):
            count = line[4 * col + 3]
            if count < seen or hidden[col] != 0:
                continue
            then, now = line[4 * col] / count, np.float32(pixels[3 * col])
            off = int(np.rint(now - then))
            if -_MOST <= off <= _MOST:
                out[min(int((now + then) / (2 * _WIDE)), _LEVELS - 1), off + _MOST] += 1


@njit(cache=True, nogil=True)
def _has_changed(counts: NDArray[np.int64], changes: NDArray[np.float64]) -> bool:
    """Fill in the median difference of each level, nan if unknown; return whether they matter."""
    total = 0
    distance = 0.0
    for level in range(_LEVELS):
        of_level = counts[level].sum()
        changes[level] = np.nan
        if of_level < _LEAST_OF_LEVEL:
            continue
        below, middle = counts[level, 0], 0
        while 2 * below < of_level:
            middle += 1
            below += counts[level, middle]
        changes[level] = middle - _MOST
        total += of_level
        distance += abs(changes[level]) * of_level
    return total >= _LEAST_PIXELS and distance >= _LEAST_CHANGE * total


def tone_curve(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    people: NDArray[np.uint8],
    windows: Sequence[Window],
) -> NDArray[np.uint8] | None:
    """
    Return what takes the grey levels of a frame back to those remembered, (256,) uint8.

    :param sums: (h, w, 4) float32, see :class:`~.model.BackgroundModel`.
    :param lab: (h, w, 3) uint8, the frame.
    :param people: (h, w) uint8, non-zero where people may be.
    :param windows: the rows and columns to compare.
    :returns: None if nothing has changed, or what has changed is not the tone.
    """
    counts = np.zeros((_LEVELS, 2 * _MOST + 1), np.int64)
    for rows, columns in windows:
        _count(sums, lab, people, rows.start, rows.stop, columns.start, columns.stop, counts)
    changes = np.zeros(_LEVELS)
    if not _has_changed(counts, changes):
        return None
    used = np.flatnonzero(np.isfinite(changes))
    change = changes[used]
    off = np.arange(-_MOST, _MOST + 1)
    left = (counts[used] * np.abs(off - change[:, None])).sum()
    if left > _MOST_LEFT * (counts[used] * np.abs(off)).sum():
        return None
    level = (used + 0.5) * _WIDE
    now = np.maximum.accumulate(level + change / 2)
    lightness = _LIGHTNESS - np.interp(_LIGHTNESS, now, change)
    return np.rint(np.interp(lightness, _LIGHTNESS, _GRAY)).astype(np.uint8)
