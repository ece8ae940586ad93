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

    A candidate is ended when it vanishes in the open, or when after a second its masks have not
    the shape of a body, and confirmed after three. What was found by its looks is ended when it
    does not move for one. A tracked person is lost in a gap, outside of
    the image, and when too little is seen in two frames in a row. A lost person is tracked again
    when they are found, and ended when they are not for so long as ``patience`` says. Whom a
    detector saw reliably and does not any more is lost until it sees them again, and so is what
    looks otherwise since it has ceased to move, until it does.

    :param stamp_ns: of the newest frame.
    :param gap_s: seconds without a frame before that.
    """
    lost, probation = track.state == LOST, track.probation
    if probation is not None:
        if lost and track.is_inside:
            return ENDED, 'it vanished in the open'
        if not probation.is_passed(stamp_ns):
            return ENDED, 'it has not the shape of a body'
    if track.stillness.is_thing:
        return ENDED, 'it has not moved since it was found'
    if gap_s > GAP_S:
        return LOST, f'no frame came for {gap_s:.1f} s'
    doubt = _doubt(track)
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


def _doubt(track: Track) -> str:
    """Return what says that it is not the person any more, '' if nothing does."""
    if track.attendance.is_doubted:
        return 'the detector, which saw them, does not any more'
    if track.stillness.is_doubted:
        return 'what is there does not move, and looks otherwise than they did'
    return ''
