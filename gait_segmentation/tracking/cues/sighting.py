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
from gait_segmentation.tracking.state import Place

_MARGIN = 0.1
"""How far about the box a person may be, in body heights."""

_BEYOND = -6.0
"""Log ratio of what is farther away."""

_HELD_NS = 700_000_000
"""Time for which a box counts, as it goes along with the body."""

_TRUSTED = 0.5
"""Trust in a heat map above which its outline says all that a box would."""


class SightingCue(Cue):
    """Where a detector saw one person last."""

    def __init__(self) -> None:
        """Begin without having been seen."""
        self._seen: tuple[Box, Place] | None = None

    def see(self, box: Box, place: Place) -> None:
        """Take in a box in working pixels, in the frame of a place."""
        self._seen = box, place

    @property
    def newest(self) -> Place | None:
        """Return the place at which they were seen last."""
        return None if self._seen is None else self._seen[1]

    def box_in(self, place: Place) -> Box | None:
        """Return the last box as it has gone along with the body, None without one of late."""
        if self._seen is None:
            return None
        box, then = self._seen
        if place.stamp_ns - then.stamp_ns > _HELD_NS:
            return None
        (x, y), (to_x, to_y) = then.displacement, place.displacement
        return box.shifted(to_x - x, to_y - y)

    def evidence(self, given: CueInput) -> Evidence | None:
        """Return what the last box says of the newest frame, see :meth:`Cue.evidence`."""
        box, heat = self.box_in(given.states[-1].place), given.view.heat
        shown = given.drawn is not None or (heat is not None and heat.trust > _TRUSTED)
        if box is None or shown:
            return None
        margin = _MARGIN * box.height
        rows, columns = given.window
        here = box.shifted(-columns.start, -rows.start)
        height, width = given.logit.shape
        logit = np.full((height, width), _BEYOND, np.float32)
        logit[here.padded(margin, margin).slices(width, height)] = 0
        return Evidence(logit)
