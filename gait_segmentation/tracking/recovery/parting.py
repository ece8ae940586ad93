# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parting a mask that shows two people, as after one has passed before the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Bounds

__all__ = ['Part', 'may_show_two', 'nearer', 'others_than', 'parts_of']

_WIDE, _TALL = 0.6, 1.1
"""Size of a mask in body heights from which it may show two people."""

_BRIDGE = 0.05
"""Width up to which what is between two people does not connect them, in body heights."""

_LEAST_HEIGHT, _LEAST_AREA = 0.35, 0.02
"""Size of a part that may be somebody, in body heights."""

_BESIDE, _BELOW = 0.3, 0.7
"""How far apart the middles of two people are, in body heights across and down."""


@dataclass(frozen=True, eq=False)
class Part:
    """
    A part of a mask that may be somebody.

    ``pixels`` is (h, w) uint8 0/255 in the bounds of the mask; ``bounds`` and ``center`` (x, y)
    are its own, counted from there.
    """

    pixels: NDArray[np.uint8]
    bounds: Bounds
    center: tuple[float, float]


def may_show_two(bounds: Bounds, height: float) -> bool:
    """
    Return whether a mask is so large that it may show two people.

    :param bounds: of the mask.
    :param height: of the body in pixels.
    """
    return bounds[2] >= _WIDE * height or bounds[3] >= _TALL * height


def parts_of(mask: NDArray[np.uint8], height: float) -> list[Part]:
    """
    Return the parts of a mask that may be people.

    :param mask: (h, w) uint8 0/255, cut out at its bounds.
    :param height: of the body in pixels.
    """
    size = max(2, round(_BRIDGE * height))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    # What is cut off by the border of the image is not narrow there.
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc, borderType=cv2.BORDER_REPLICATE)
    count, labels, stats, centers = cv2.connectedComponentsWithStats(opened, connectivity=4)
    found = []
    for number in range(1, count):
        left, top, width, tall, area = (int(value) for value in stats[number])
        if tall >= _LEAST_HEIGHT * height and area >= _LEAST_AREA * height**2:
            pixels = np.uint8(255) * (labels == number).view(np.uint8)
            x, y = centers[number]
            found.append(Part(pixels, (left, top, width, tall), (float(x), float(y))))
    return found


def others_than(part: Part, parts: list[Part], height: float) -> list[Part]:
    """Return those parts that cannot be of the same person as one, who is ``height`` tall."""
    x, y = part.center
    return [
        each
        for each in parts
        if math.hypot((each.center[0] - x) / _BESIDE, (each.center[1] - y) / _BELOW) >= height
    ]


def nearer(mask: NDArray[np.uint8], theirs: list[Part], ours: list[Part]) -> NDArray[np.uint8]:
    """
    Return what of a mask is nearer to some parts than to others, (h, w) uint8 0/255.

    :param mask: (h, w) uint8 0/255, cut out at its bounds.
    """
    away = []
    for parts in (theirs, ours):
        outside = np.full(mask.shape, 255, np.uint8)
        for part in parts:
            outside[part.pixels > 0] = 0
        away.append(cv2.distanceTransform(outside, cv2.DIST_L2, 3))
    return np.where(away[0] < away[1], mask, 0).astype(np.uint8)
