# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Jumps of the exposure, undone.

A camera that changes its exposure from one frame to the next makes all colours others than those
learnt.  The brightness of most pixels then changes by one factor, which can be measured and taken
back.  Slow changes are left to the models, which follow them by learning.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.brightness import brightening
from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.kernels import kernel

__all__ = ['Exposure']

_DARKEST = 12
_BRIGHTEST = 255 - _DARKEST
"""Brightness outside of which a cell may be clipped."""

_LEAST_CELLS = 50
_AGREE = 0.6
"""Share of the cells that must have changed by the same factor."""

_JUMP = math.log(1.08)
_MOST = math.log(4.0)


class Exposure:
    """
    Watches the brightness of a stream.

    ``gain`` is what frames must be multiplied with to look as the first one did.
    """

    def __init__(self) -> None:
        """Begin with the exposure of the first frame."""
        self.gain = 1.0
        self._last: NDArray[np.float32] | None = None

    def update(self, frame: Pyramid) -> float:
        """
        Take in a frame; one in which nothing can be seen says nothing.

        :param frame: its brightness as it came.
        :returns: the gain for it.
        """
        if frame.is_blank:
            return self.gain
        # Cells, so that neither texture nor a shift of the picture counts.
        now = frame.cells
        last = self._last
        if last is not None and last.shape == now.shape:
            step = math.exp(_JUMP)
            used, changed = _count(now, last, self.gain / step, self.gain * step)
            # If fewer than half have changed, so has not the median.
            if used >= _LEAST_CELLS and 2 * changed >= used:
                self._judge(now, last)
        self._last = np.minimum(np.float32(self.gain) * now, np.float32(255))
        return self.gain

    def _judge(self, now: NDArray[np.uint8], last: NDArray[np.float32]) -> None:
        """Take over the factor of two frames if it is that of most cells."""
        total, agree, _ = brightening(last, now, (_DARKEST, _BRIGHTEST), _JUMP)
        if abs(total - math.log(self.gain)) > _JUMP and agree > _AGREE:
            self.gain = math.exp(min(max(total, -_MOST), _MOST))


@kernel('u1[:,::1], f4[:,::1], f8, f8')
def _count(
    now: NDArray[np.uint8], last: NDArray[np.float32], low: float, high: float
) -> tuple[int, int]:
    """Count the cells that can be compared, and those whose factor is not between two bounds."""
    least, most = np.float32(low), np.float32(high)
    used = changed = 0
    for row in range(now.shape[0]):
        for col in range(now.shape[1]):
            here, then = now[row, col], last[row, col]
            if _DARKEST < here < _BRIGHTEST and _DARKEST < then < _BRIGHTEST:
                used += 1
                changed += not least * here < then < most * here
    return used, changed
