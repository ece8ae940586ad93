# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The similarity that most of some points, seen in two frames, agree on."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['camera_motion']

_LEAST_POINTS = 8
_STILL_PX = 0.2
"""Points that are needed, and the median shift up to which they stand still."""

_REACH_PX = 0.75
"""How far off a point may be that still counts: little, or slow walkers pull the world along."""

_MOST_SAMPLES = 100
"""Pairs of points tried."""

_MOST_TURN, _MOST_ZOOM = 0.2, 1.2
"""Largest rotation (radians) and zoom from frame to frame that are believed."""

_LEAST_AGREEING = 1 / 3
"""Share of the corners that must agree on the camera's motion; else it counts as unknown."""


def camera_motion(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """
    Return the similarity that most points agree on, None if they stand still or are few.

    :param before, after: (n, 2) float32, positions (x, y) of the same points in two frames.
    :returns: 2 x 3 transform of positions.
    """
    if len(before) < _LEAST_POINTS:
        return None
    shift = np.hypot(*(after - before).T)
    if np.partition(shift, len(shift) // 2)[len(shift) // 2] < _STILL_PX:
        return None
    # OpenCV draws the same samples in every call.
    motion, agrees = cv2.estimateAffinePartial2D(
        before, after, ransacReprojThreshold=_REACH_PX, maxIters=_MOST_SAMPLES
    )
    if motion is None or np.count_nonzero(agrees) < _LEAST_AGREEING * len(before):
        return None
    zoom = np.hypot(motion[0, 0], motion[1, 0])
    if abs(motion[1, 0]) > _MOST_TURN or not 1 / _MOST_ZOOM < zoom < _MOST_ZOOM:
        return None
    return np.asarray(motion)
