# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far away a body is by a registered depth image."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.localization.camera import CameraPose, PinholeCamera

__all__ = ['distance_by_depth']

_SAMPLES = 2500
"""Pixels of a body that are looked at."""

_INSIDE = 0.01
"""How far inside the outline depth is believed, in heights of the mask: at the edge it mixes."""

_LEAST_VALID = 0.2
"""Share of the body's pixels that must have a depth."""

_REACH_M = 0.5
"""How far limbs reach from the body's axis: what is farther from the median is not the body."""

DepthImage = NDArray[np.uint16] | NDArray[np.float32]


def distance_by_depth(
    depth: DepthImage,
    mask: NDArray[np.uint8],
    camera: PinholeCamera,
    pose: CameraPose,
    towards: NDArray[np.float64],
    most: float,
) -> float | None:
    """
    Return the distance over the ground of the surface that is seen of a body, in metres.

    The median over the pixels of the mask, then that of those within reach of it: holes and what
    shows through them count nothing.

    :param depth: (H, W) along the camera's z, uint16 in millimetres or float32 in metres; zero,
        negative, not finite or beyond ``most`` is invalid.
    :param mask: (H, W) uint8, not zero = body.
    :param towards: (2,) the horizontal direction from the camera to the body, of length 1.
    :param most: largest distance in metres.
    :returns: None if too little of the body has a valid depth.
    """
    box = Box.around(mask)
    if box is None:
        return None
    rows, columns = box.slices(mask.shape[1], mask.shape[0])
    inside = _eroded(mask[rows, columns], _INSIDE * box.height)
    y, x = np.nonzero(inside)
    # Not every so many rows and columns, which holes may be as well.
    some = slice(None, None, math.ceil(len(y) / _SAMPLES))
    y, x = y[some], x[some]
    at = depth[rows, columns][y, x]
    metres = at * np.float64(1e-3) if depth.dtype == np.uint16 else at.astype(np.float64)
    valid = (metres > 0) & (metres <= most)  # What is no number is not valid.
    if not valid.any() or valid.sum() < _LEAST_VALID * len(valid):
        return None
    points = np.column_stack([x, y])[valid] + (columns.start + 0.5, rows.start + 0.5)
    along = camera.rays(points) @ (pose.rotation[:2].T @ towards) * metres[valid]
    return float(np.median(along[np.abs(along - np.median(along)) <= _REACH_M]))


def _eroded(mask: NDArray[np.uint8], margin: float) -> NDArray[np.uint8]:
    """Return a mask without its margin, as it is where nothing would be left."""
    size = 1 + 2 * math.ceil(margin)
    smaller = cv2.erode(mask, np.ones((size, size), np.uint8), borderValue=0)
    return smaller if smaller.any() else mask
