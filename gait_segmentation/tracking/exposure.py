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

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['Exposure']

_CELL = 8
_DARKEST, _BRIGHTEST = 12, 243
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

    def update(self, gray: NDArray[np.uint8]) -> float:
        """
        Take in a frame.

        :param gray: (h, w) uint8, its brightness as it came.
        :returns: the gain for it.
        """
        # Means of cells, so that neither texture nor a shift of the picture counts.
        size = (max(gray.shape[1] // _CELL, 1), max(gray.shape[0] // _CELL, 1))
        now = cv2.resize(gray, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        last = self._last
        if last is not None and last.shape == now.shape:
            use = (now > _DARKEST) & (now < _BRIGHTEST) & (last > _DARKEST) & (last < _BRIGHTEST)
            if np.count_nonzero(use) >= _LEAST_CELLS:
                total = np.log(last[use] / now[use])
                middle = float(np.median(total))
                agree = np.count_nonzero(np.abs(total - middle) < _JUMP) / total.size
                if abs(middle - math.log(self.gain)) > _JUMP and agree > _AGREE:
                    self.gain = math.exp(min(max(middle, -_MOST), _MOST))
        self._last = np.minimum(self.gain * now, np.float32(255))
        return self.gain
