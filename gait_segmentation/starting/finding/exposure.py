# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The camera's exposure undone, so that images stay as bright as the background was first seen.

Automatic exposure multiplies the whole image, step by step or at once.  Against a background
that was learnt before, everything then stands out.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.brightness import brightening

__all__ = ['Exposure']

_STEP = 4
"""Distance of the pixels that are compared."""

_LEAST_PIXELS = 200
_DARK, _BRIGHT = 23, 246
"""Lightness between which a pixel tells the exposure."""

_JUMP, _ALIKE = 0.08, 0.05
"""Least change between two frames, as a logarithm, that is undone at once, and how near to it
pixels are that changed as much."""

_JUMP_SHARE = 0.5
"""Share of the pixels that must have changed as much."""

_DRIFT = 0.015
"""Least difference from the background, as a logarithm, that is undone."""

_BETTER = 0.9
"""How much smaller undoing it must make the mean difference, as a share."""

_CUT = 24.0
"""Most that one pixel can say in that mean, in grey levels."""

_FULL = 245
"""Lightness from which a pixel may be as bright as can be."""

_MOST = 1.0
"""Largest change undone, as a logarithm: beyond, too little is left of the image."""


class Exposure:
    """Measures how much brighter images are than the background, and undoes it."""

    def __init__(self) -> None:
        """Take the next image for as bright as the background."""
        self._log = 0.0
        self._last: NDArray[np.uint8] | None = None

    def undo(self, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """
        Return an image as bright as the last one became.

        :param colours: (h, w, 3) uint8, lightness first, then two of chroma.
        """
        gray = np.ascontiguousarray(colours[::_STEP, ::_STEP, 0])
        last, self._last = self._last, gray
        if last is not None:
            jump, share, pixels = brightening(gray, last, (_DARK, _BRIGHT), _ALIKE)
            if pixels >= _LEAST_PIXELS and abs(jump) > _JUMP and share > _JUMP_SHARE:
                self._change(jump)
        return _scaled(colours, -self._log)

    def settle(
        self,
        canvas: NDArray[np.uint8],
        background: NDArray[np.uint8],
        count: NDArray[np.uint8],
        hidden: NDArray[np.uint8],
    ) -> NDArray[np.uint8]:
        """
        Return the canvas as bright as the background, and note by how much it was not.

        :param canvas: (h, w, 3) uint8, what :meth:`undo` returned, laid onto the canvas.
        :param background: (h, w, 3) uint8.
        :param count: (h, w) uint8, 0 where the background is not known.
        :param hidden: (h, w) uint8, non-zero where something moved.
        """
        part = slice(None, None, _STEP), slice(None, None, _STEP)
        known = (count[part] > 0) & (hidden[part] == 0)
        now, before = canvas[part][..., 0][known], background[part][..., 0][known]
        drift, _, pixels = brightening(now, before, (_DARK, _BRIGHT), _ALIKE)
        drifts = pixels >= _LEAST_PIXELS and abs(drift) > _DRIFT
        if drifts and _off(now, before, drift) < _BETTER * _off(now, before, 0):
            log = self._log
            self._change(drift)
            canvas = _scaled(canvas, log - self._log)
        if self._log > _DRIFT:
            # What is as bright as can be may be brighter.
            full = canvas[:, :, 0] >= _FULL * np.exp(-self._log)
            full &= background[:, :, 0] > canvas[:, :, 0]
            canvas = np.where(full[:, :, None], background, canvas)
        return canvas

    def _change(self, log: float) -> None:
        self._log = min(max(self._log + log, -_MOST), _MOST)
        if abs(self._log) < _DRIFT / 2:
            self._log = 0.0


def _off(now: NDArray[np.uint8], before: NDArray[np.uint8], log: float) -> float:
    """Return the mean difference once a change is undone."""
    off = np.abs(now * np.float32(np.exp(-log)) - before)
    return float(np.minimum(off, np.float32(_CUT)).mean())


def _scaled(colours: NDArray[np.uint8], log: float) -> NDArray[np.uint8]:
    """Return an image made brighter; chroma grows with the light."""
    if log == 0:
        return colours
    gain = float(np.exp(log))
    levels = np.arange(256, dtype=np.float32)
    light, chroma = levels * gain, (levels - 128) * gain + 128
    table = np.stack([light, chroma, chroma], axis=1)[None]
    return np.asarray(cv2.LUT(colours, np.clip(np.rint(table), 0, 255).astype(np.uint8)))
