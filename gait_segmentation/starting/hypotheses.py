# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hypotheses about a first box: templates stretched onto it, one for each direction of walking."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import bounding_box

VIEWS = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4, np.pi)
"""Directions of walking; towards and away from the camera look the same to a silhouette."""

_SIGMA = 0.32
"""
Spread of a box's aspect about that of its template, and most that a template is stretched in one
direction against the other, as logarithms.
"""

_NEGLIGIBLE = 0.02
"""Templates whose aspect is this much less likely than the best one's are left out."""

_BLUR_PX = 0.7
"""Blur of averaged templates."""


@dataclass(frozen=True)
class Hypothesis:
    """
    The templates of one direction of walking laid onto a box.

    ``templates`` is (K, h, w) uint8 of the window, ``weight`` (K,) float32 their prior weight by
    aspect and ``bodies`` their K body frames in the window.
    """

    templates: NDArray[np.uint8]
    weight: NDArray[np.float32]
    bodies: Sequence[BodyFrame]

    def average(self, weights: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return the mean of the templates by (K,) weights, blurred, (h, w) float32 in 0..1."""
        share = (weights / (255 * max(float(weights.sum()), 1e-12))).astype(np.float32)
        mean = np.tensordot(share, self.templates.astype(np.float32), 1)
        return np.asarray(cv2.GaussianBlur(mean, (0, 0), _BLUR_PX))


def lay_onto(
    box: Box,
    bank: TemplateBank,
    shape: tuple[int, int],
    cuts: tuple[bool, bool, bool, bool],
    view: float,
    taller: float = 1.0,
    beyond: bool = False,
    angle: float = 0.0,
) -> Hypothesis:
    """
    Lay the templates of a direction onto a box, extents on extents.

    :param box: the tight box of the person in the window's pixels.
    :param shape: (h, w) of the window.
    :param cuts: whether the box ends at the upper, lower, left and right border of the image.
    :param view: the direction of walking.
    :param taller: height of the body in heights of the box, which shows its upper part, or the
        lower one if the upper border alone cuts it.
    :param beyond: whether the body goes on beyond the side of the image that the box ends at: only
        the other side of the box is that of the body.
    :param angle: tilt of the body in radians, positive when the head leans to the right.
    """
    difference = np.abs(np.angle(np.exp(1j * (bank.azimuth.astype(np.float64) - view))))
    sequences = np.flatnonzero(difference <= difference.min() + 1e-3)
    grids = bank.templates[sequences].reshape(-1, *bank.grid)
    if angle:
        grids = np.stack([_turned(template, angle) for template in grids])
    tight = np.array([bounding_box((grid > 127).view(np.uint8)) for grid in grids])
    grids, tight = grids[tight[:, 2] > 0], tight[tight[:, 2] > 0]
    ratio = np.log(tight[:, 2] / tight[:, 3] * taller * box.height / box.width)
    weight = np.exp(-0.5 * ((np.minimum(ratio, 0) if beyond else ratio) / _SIGMA) ** 2)
    likely = weight >= _NEGLIGIBLE * weight.max()
    x, y, width, height = tight[likely].T
    scale_y = taller * box.height / height
    upper = box.bottom - taller * box.height if cuts[0] and not cuts[1] else box.y
    if beyond:
        scale_x = scale_y
        left = box.right - scale_x * (x + width) if cuts[2] else box.x - scale_x * x
    else:
        scale_x = scale_y * np.exp(np.clip(-ratio[likely], -_SIGMA, _SIGMA))
        left = box.center_x - scale_x * (x + width / 2)
    top = upper - scale_y * y
    # As geometry.pixel_affine does it, for all templates at once.
    matrices = np.zeros((len(x), 2, 3))
    matrices[:, 0, 0], matrices[:, 0, 2] = scale_x, left + (scale_x - 1) / 2
    matrices[:, 1, 1], matrices[:, 1, 2] = scale_y, top + (scale_y - 1) / 2
    templates = [
        cv2.warpAffine(grid, matrix, shape[::-1], flags=cv2.INTER_LINEAR)
        for grid, matrix in zip(grids[likely], matrices, strict=True)
    ]
    axis, middle = left + scale_x * grids.shape[2] / 2, top + scale_y * grids.shape[1] / 2
    tall = scale_y * bank.fill * bank.grid[0]
    bodies = [
        BodyFrame(x, y, high, angle)
        for x, y, high in np.stack([axis, middle, tall], axis=1).tolist()
    ]
    return Hypothesis(np.stack(templates), weight[likely].astype(np.float32), bodies)


def _turned(template: NDArray[np.uint8], angle: float) -> NDArray[np.uint8]:
    """Return a template turned about the middle of its grid, on a square one that holds it."""
    height, width = template.shape
    side = math.ceil(math.hypot(height, width))
    cos, sin = math.cos(angle), math.sin(angle)
    center = np.array([(width - 1) / 2, (height - 1) / 2])
    turn = np.array([[cos, -sin], [sin, cos]])
    matrix = np.column_stack([turn, (side - 1) / 2 - turn @ center])
    return np.asarray(cv2.warpAffine(template, matrix, (side, side)))
