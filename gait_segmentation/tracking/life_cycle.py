# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""When a track is confirmed, lost, found again and ended."""

from __future__ import annotations

from gait_segmentation.results import LOST, TRACKED
from gait_segmentation.tracking.track import Track

ENDED = 'ended'
"""State of a track whose slot is free again."""

_LOST_FRAMES = 2
"""Frames in a row in which too little is seen after which a person is lost."""

GAP_S = 0.5
"""Time between two frames from which on no one is followed from one to the other."""


def next_state(track: Track, stamp_ns: int, *, gap_s: float = 0.0) -> tuple[str, str]:
    """
    Return the state of a track from now on, and why; nothing else decides over it.

    What cannot be a person by all that is known, see :class:`.Existence`, is ended. A tracked
    person is lost in a gap, outside of the image, when they are rather not there, and when too
    little is seen in two frames in a row. A lost person is tracked again when they are found and
    rather there, and ended when they are not for so long as ``patience`` says.

    :param stamp_ns: of the newest frame.
    :param gap_s: seconds without a frame before that.
    """
    lost, existence = track.state == LOST, track.existence
    doubt = existence.doubt(stamp_ns)
    if existence.evidence(stamp_ns) < 0:
        # Of somebody who is not published nobody asks that yet.
        if track.slot is not None:
            return ENDED, doubt
        doubt = ''
    if gap_s > GAP_S:
        return LOST, f'no frame came for {gap_s:.1f} s'
    if lost and track.found and not doubt:
        return TRACKED, ''
    if lost and track.lost_s > track.config.patience:
        return ENDED, f'not found for {track.lost_s:.1f} s'
    if lost:
        return LOST, track.reason
    if doubt:
        return LOST, doubt
    if track.is_outside:
        return LOST, 'outside of the image'
    if track.unseen_frames >= _LOST_FRAMES:
        return LOST, 'hidden, or not distinct from the surroundings'
    return TRACKED, ''
