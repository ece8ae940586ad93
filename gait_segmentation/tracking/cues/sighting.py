# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The cue from a detector: what is beyond the box in which it sees a person is not theirs.

A cabinet that was taken into the first mask, or a patch of lawn that came along, has the colours
that the track has learnt, so nothing that it knows speaks against it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.tracking.cues import Cue, CueInput, Evidence
from gait_segmentation.tracking.state import State

_MARGIN, _FAR = 0.1, 0.25
"""How far about the box a person may well be, and from which they hardly are, in body heights."""

_BEYOND = -6.0
"""Log ratio of what is that far away."""

_AT_BORDER = 0.02
"""How near the border of the image a box ends that says nothing of that side, in its height."""

_HELD_NS = 700_000_000
"""Time for which a box counts, as it goes along with the body."""

_TRUSTED = 0.5
"""Trust in a heat map above which its outline says all that a box would."""


class SightingCue(Cue):
    """Where a detector saw one person last."""

    def __init__(self) -> None:
        """Begin without having been seen."""
        self._seen: tuple[Box, State] | None = None

    def see(self, box: Box, state: State) -> None:
        """Take in a box in working pixels, in the frame of a state."""
        self._seen = box, state

    def box_in(self, state: State) -> Box | None:
        """Return the last box as it has gone along with the body, None without one of late."""
        if self._seen is None:
            return None
        box, then = self._seen
        if state.frame.image.stamp_ns - then.frame.image.stamp_ns > _HELD_NS:
            return None
        (x, y), (to_x, to_y) = then.displacement, state.displacement
        return box.shifted(to_x - x, to_y - y)

    def evidence(self, given: CueInput) -> Evidence | None:
        """Return what the last box says of the newest frame, see :meth:`Cue.evidence`."""
        box, heat = self.box_in(given.states[-1]), given.view.heat
        shown = given.drawn is not None or (heat is not None and heat.trust > _TRUSTED)
        if box is None or shown:
            return None
        (rows, columns), (height, width) = given.window, given.view.shape
        x = _outside(columns, box.x, box.right, width, _AT_BORDER * box.height)
        y = _outside(rows, box.y, box.bottom, height, _AT_BORDER * box.height)
        away = np.maximum(x[None, :], y[:, None]) / np.float32(box.height)
        return Evidence(_BEYOND * np.clip((away - _MARGIN) / (_FAR - _MARGIN), 0, 1))


def _outside(
    pixels: slice, first: float, last: float, size: int, close: float
) -> NDArray[np.float32]:
    """
    Return how far pixels of one axis are outside of a box, (n,) float32.

    :param pixels: of the window.
    :param first, last: ends of the box; one at the border of the image is none.
    :param size: of the image.
    :param close: how near the border that is.
    """
    middle = np.arange(pixels.start, pixels.stop, dtype=np.float32) + np.float32(0.5)
    before = np.float32(first) - middle if first > close else np.float32(0)
    beyond = middle - np.float32(last) if last < size - close else np.float32(0)
    return np.maximum(np.maximum(before, beyond), np.float32(0)) * np.ones_like(middle)
