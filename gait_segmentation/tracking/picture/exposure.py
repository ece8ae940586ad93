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

from gait_segmentation.ego_motion.pyramid import Pyramid

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
        now = frame.cells.astype(np.float32)
        if self._last is not None and self._last.shape == now.shape:
            self._judge(now, self._last)
        self._last = np.minimum(np.float32(self.gain) * now, np.float32(255))
        return self.gain

    def _judge(self, now: NDArray[np.float32], last: NDArray[np.float32]) -> None:
        """Take over the factor of two frames if it is that of most cells."""
        use = (now > _DARKEST) & (now < _BRIGHTEST) & (last > _DARKEST) & (last < _BRIGHTEST)
        if np.count_nonzero(use) < _LEAST_CELLS:
            return
        logs = np.log(last[use] / now[use])
        total = float(np.median(logs))
        agree = np.count_nonzero(np.abs(logs - total) < _JUMP)
        if abs(total - math.log(self.gain)) > _JUMP and agree > _AGREE * logs.size:
            self.gain = math.exp(min(max(total, -_MOST), _MOST))
