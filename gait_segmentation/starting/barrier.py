# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How well a pixel inside the first box is connected with the surroundings outside of it.

The minimum barrier distance (Strand, Ciesielski, Malmberg and Saha, CVIU 2013; by raster scans as
in Zhang et al., ICCV 2015) from the outside of the box is the least range of colours on any path
there.  Walls, floor and pillars that run on into the box are near, a person is not.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['barrier_distance', 'barrier_logit']

_SCANS = 6
_FAR = np.float32(1e9)
_LEVEL, _TEXTURE_GAIN = 15.0, 0.7
"""Distance that says nothing: a constant and a share of the texture's range of colours."""

_SLOPE = 0.5
_LIMIT = 2.0


@kernel('u1[:,:,::1], f4[:,::1], u1[:,:,::1], u1[:,:,::1], b1')
def _scan(
    image: NDArray[np.uint8],
    distance: NDArray[np.float32],
    high: NDArray[np.uint8],
    low: NDArray[np.uint8],
    forward: bool,
) -> None:
    height, width = distance.shape
    step = -1 if forward else 1
    for i in range(height):
        row = i if forward else height - 1 - i
        for j in range(width):
            col = j if forward else width - 1 - j
            if distance[row, col] == 0:
                continue
            for side in range(2):
                from_row = row + step if side == 0 else row
                from_col = col if side == 0 else col + step
                if not (0 <= from_row < height and 0 <= from_col < width):
                    continue
                if distance[from_row, from_col] >= _FAR:
                    continue
                barrier = 0
                for channel in range(3):
                    value = image[row, col, channel]
                    top = max(high[from_row, from_col, channel], value)
                    bottom = min(low[from_row, from_col, channel], value)
                    barrier += top - bottom
                if barrier < distance[row, col]:
                    distance[row, col] = barrier
                    for channel in range(3):
                        value = image[row, col, channel]
                        high[row, col, channel] = max(high[from_row, from_col, channel], value)
                        low[row, col, channel] = min(low[from_row, from_col, channel], value)


def barrier_distance(image: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return the minimum barrier distance of each pixel from the outside of a region.

    :param image: (h, w, 3) uint8.
    :param inside: (h, w) bool, the region; all other pixels have distance zero.
    :returns: (h, w) float32, in grey levels summed over the channels; 1e9 where the region has
        no outside.
    """
    distance = np.where(inside, _FAR, np.float32(0)).astype(np.float32)
    high, low = image.copy(), image.copy()
    for number in range(_SCANS):
        _scan(image, distance, high, low, number % 2 == 0)
    return distance


def barrier_logit(lab: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return evidence for the person from the barrier distance, zero outside of the region.

    What distance is large depends on the texture of the surroundings, and is measured there.

    :param lab: (h, w, 3) uint8.
    :param inside: (h, w) bool, the box.
    :returns: (h, w) float32, limited to +-2.
    """
    if inside.all() or not inside.any():
        return np.zeros(inside.shape, np.float32)
    smooth = cv2.GaussianBlur(lab, (3, 3), 0)
    kernel = np.ones((5, 5), np.uint8)
    spread = cv2.absdiff(cv2.dilate(smooth, kernel), cv2.erode(smooth, kernel))
    texture = float(np.median(spread[~inside].sum(axis=1, dtype=np.int32)))
    neutral = _LEVEL + _TEXTURE_GAIN * texture
    logit = (barrier_distance(smooth, inside) - neutral) / (_SLOPE * neutral)
    return (np.clip(logit, -_LIMIT, _LIMIT) * inside).astype(np.float32)
