# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is likely theirs of who has no slot, of whom no mask is cut: they learn from that."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import distance_from, overlap, placed, within
from gait_segmentation.results import LOST, Feedback
from gait_segmentation.tracking.track import Track
from gait_segmentation.tracking.visibility import GUARD

_NOTE = 'own'
"""Name of the note of it."""

_COMMON = 0.1
"""Share of somebody from which they meet another one."""


def keep_own(track: Track, likelihood: NDArray[np.uint8], others: Sequence[Track]) -> None:
    """
    Keep what is likely theirs as the mask of the newest frame, if nobody is met.

    :param likelihood: (h, w) uint8 of the view.
    :param others: in the view, of whom masks are cut.
    """
    if track.state == LOST or track.is_outside or any(_meet(track, each) for each in others):
        return
    near = distance_from(track.expected_mask() > 127) < GUARD * track.pose.height
    likely = likelihood[track.window] > 127
    mask = np.where(near & likely, np.uint8(255), np.uint8(0))
    track.history.note(_NOTE, track.window, mask)


def own_feedback(track: Track, stamp_ns: int) -> Feedback | None:
    """Return what was kept of a frame without a mask, in working pixels, if anything was."""
    for state in track.history.states:
        noted = state.notes.get(_NOTE)
        if noted is not None and state.frame.image.stamp_ns == stamp_ns:
            mask = placed(noted[1], noted[0], track.view.shape)
            return Feedback(stamp_ns, track.track_id, mask, None, mask)
    return None


def _meet(track: Track, other: Track) -> bool:
    """Return whether somebody is expected where another one is."""
    window, expected = track.window, track.expected_mask()
    shared = overlap(other.window, window)
    if shared is None:
        return False
    theirs = other.expected_mask()[within(shared, other.window)]
    both = cv2.bitwise_and(expected[within(shared, window)], theirs)
    return cv2.countNonZero(both) > _COMMON * cv2.countNonZero(expected)
