# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The cue from a detector: what is beyond the box in which it sees a person is not theirs.

A cabinet that was taken into the first mask, or a patch of lawn that came along, has the colours
that the track has learnt, so nothing that it knows speaks against it.
"""

from __future__ import annotations

import numpy as np

from gait_segmentation.geometry import Box
from gait_segmentation.tracking.cues import Cue, CueInput, Evidence
from gait_segmentation.tracking.track import State

_MARGIN = 0.1
"""How far about the box a person may be, in body heights."""

_BEYOND = -6.0
"""Log ratio of what is farther away."""

_HELD_NS = 700_000_000
"""Time for which a box counts, as it goes along with the body."""


class SightingCue(Cue):
    """Where a detector saw one person last."""

    def __init__(self) -> None:
        """Begin without having been seen."""
        self._seen: tuple[Box, State] | None = None

    def see(self, box: Box, state: State) -> None:
        """Take in a box in working pixels, in the frame of a state."""
        self._seen = box, state

    def evidence(self, given: CueInput) -> Evidence | None:
        """Return what the last box says of the newest frame, see :meth:`Cue.evidence`."""
        if self._seen is None:
            return None
        box, state = self._seen
        stamp_ns = given.view.now.image.stamp_ns
        if stamp_ns - state.frame.image.stamp_ns > _HELD_NS:
            return None
        margin = _MARGIN * box.height
        rows, columns = given.window
        here = box.shifted(*given.moved(state)).shifted(-columns.start, -rows.start)
        height, width = given.logit.shape
        logit = np.full((height, width), _BEYOND, np.float32)
        logit[here.padded(margin, margin).slices(width, height)] = 0
        return Evidence(logit)
