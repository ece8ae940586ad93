# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Looking for a lost person all over the image, at low resolution."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.tracking.competition import REACH

__all__ = ['find_silhouette', 'searched']

_FAR_COST = 0.08
"""What a body height away from the expected place costs."""


def searched(
    mask: NDArray[np.uint8],
    place: tuple[float, float],
    reach: tuple[float, float],
    height: float,
) -> Box:
    """Return the part of an image that a search looks at, see :func:`find_silhouette`."""
    margin = round(REACH * height) + 2
    x, y = reach[0] + mask.shape[1] / 2 + margin, reach[1] + mask.shape[0] / 2 + margin
    return Box(place[0] - x, place[1] - y, 2 * x, 2 * y)


def find_silhouette(
    likelihood: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    place: tuple[float, float],
    reach: tuple[float, float],
    height: float,
) -> tuple[float, float, float] | None:
    """
    Find where a silhouette fits a likelihood best.

    :param likelihood: (h, w) uint8.
    :param mask: (H, W) uint8, the silhouette as it was last, cut out.
    :param place: (x, y) where the middle of the cut-out is expected.
    :param reach: how far (x, y) from there it may be.
    :param height: of the body, in pixels.
    :returns: (x, y) of the middle and the score: mean likelihood inside minus that in a ring
        about the silhouette (-1..1), less what the distance costs; None without a silhouette.
    """
    if not (mask > 127).any():
        return None
    margin = max(1, round(REACH * height))
    inside = np.pad((mask > 127).astype(np.float32), margin)
    size = 2 * margin + 1
    ring = cv2.dilate(inside, np.ones((size, size), np.uint8)) - inside
    kernel = inside / inside.sum() - ring / max(float(ring.sum()), 1.0)
    score = cv2.filter2D(
        likelihood, cv2.CV_32F, kernel / np.float32(255), borderType=cv2.BORDER_CONSTANT
    )
    x, y = place
    # An odd kernel is centred on a pixel, an even one half a pixel before its middle.
    off_x, off_y = (0.5 if side % 2 else 0.0 for side in inside.shape[::-1])
    away_x = np.abs(np.arange(score.shape[1], dtype=np.float32) + np.float32(off_x - x))
    away_y = np.abs(np.arange(score.shape[0], dtype=np.float32) + np.float32(off_y - y))
    score -= np.float32(_FAR_COST / height) * (away_x[None, :] + away_y[:, None])
    score[away_y > reach[1]] = -1
    score[:, away_x > reach[0]] = -1
    row, column = divmod(int(score.argmax()), score.shape[1])
    return column + off_x, row + off_y, float(score[row, column])
