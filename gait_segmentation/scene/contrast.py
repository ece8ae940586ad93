# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Levels of flat pictures, spread.

In the dark, in haze and behind glass pictures use few of the 256 levels.  The bins of histograms
and the least noise that models allow for are made for pictures that use many of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ['Contrast', 'contrast_curve']

_LEFT_OUT = 0.005
"""Share of the levels at either end that does not count."""

_FULL = 128.0
"""Levels that a picture which needs no spreading uses at least."""

_MOST = 4.0
"""Largest factor; beyond it noise is most of what is spread."""


class Contrast:
    """Spreads the levels of a stream as its first picture needs it, so that models stay valid."""

    def __init__(self) -> None:
        """Begin without having seen a picture."""
        self._curve: NDArray[np.uint8] | None = None
        self._known = False

    def curve_for(self, image: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
        """
        Return the curve that spreads the levels of a picture, (256,) uint8, None if it needs none.

        :param image: (h, w, 3) uint8; only the first one is looked at.
        """
        if not self._known:
            self._curve, self._known = contrast_curve(image), True
        return self._curve


def contrast_curve(image: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """
    Return the curve that spreads the levels of a picture, (256,) uint8, None if it needs none.

    What lies outside of the levels that count is squeezed, but stays apart: later pictures of the
    stream may use it.

    :param image: uint8 of any shape, at least one pixel.
    """
    share = np.cumsum(np.bincount(image.reshape(-1), minlength=256)) / image.size
    low, high = (int(level) for level in np.searchsorted(share, (_LEFT_OUT, 1 - _LEFT_OUT)))
    span = high - low
    wanted = min(_FULL, _MOST * span)
    if span >= wanted:
        return None
    # The rest is shared out as it was, so that black stays black and white stays white.
    bottom = (255 - wanted) * low / (255 - span)
    levels = np.interp(np.arange(256), (0, low, high, 255), (0, bottom, bottom + wanted, 255))
    return np.round(levels).astype(np.uint8)
