# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Upright boxes, and which of them can be those of people."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

__all__ = ['FARTHEST', 'Box', 'check_matched_box', 'check_start_box']

_LARGEST_START = 4.0
"""Size of a first box, in image sizes, above which it cannot be that of a person in view."""

_LEAST_MATCHED = 0.5
FARTHEST = 8.0
"""
Largest size and distance of a box to match, in the image's longer sides; its least size is half a
pixel.  Both are beyond what a tracker makes of the smallest and the largest box to start from.
"""


@dataclass(frozen=True)
class Box:
    """
    An upright rectangle in pixels: top left corner, width and height, all sub-pixel.

    :raises InputError: if a value is not finite or width or height is not positive.
    """

    x: float
    y: float
    width: float
    height: float

    def __post_init__(self) -> None:
        """Refuse boxes that are no boxes."""
        finite = math.isfinite
        # Without a loop: dozens of boxes are made in every frame.
        if not (finite(self.x) and finite(self.y) and finite(self.width) and finite(self.height)):
            values = (self.x, self.y, self.width, self.height)
            raise InputError(f'box values must be finite numbers, got {values}')
        if self.width <= 0 or self.height <= 0:
            raise InputError(
                f'box width and height must be positive, got {self.width:g} x {self.height:g}'
            )

    @property
    def right(self) -> float:
        """Return x of the right edge."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """Return y of the lower edge."""
        return self.y + self.height

    @property
    def center_x(self) -> float:
        """Return x of the centre."""
        return self.x + self.width / 2

    @property
    def center_y(self) -> float:
        """Return y of the centre."""
        return self.y + self.height / 2

    @classmethod
    def from_center(cls, center_x: float, center_y: float, width: float, height: float) -> Box:
        """Make a box from its centre and size."""
        return cls(center_x - width / 2, center_y - height / 2, width, height)

    @classmethod
    def around(cls, mask: NDArray[np.uint8] | NDArray[np.bool_]) -> Box | None:
        """
        Return the tight box of the non-zero pixels of a mask, None for an empty mask.

        :param mask: (height, width) array of any type that has a truth value.
        """
        if mask.dtype != np.uint8:
            mask = (mask if mask.dtype == np.bool_ else mask != 0).view(np.uint8)
        left, top, width, height = cv2.boundingRect(mask)
        return cls(left, top, width, height) if width > 0 else None

    def scaled(self, factor: float) -> Box:
        """Return the same box in an image ``factor`` times the size."""
        return Box(self.x * factor, self.y * factor, self.width * factor, self.height * factor)

    def shifted(self, dx: float, dy: float) -> Box:
        """Return the box moved by (dx, dy)."""
        return Box(self.x + dx, self.y + dy, self.width, self.height)

    def padded(self, dx: float, dy: float) -> Box:
        """Return the box grown by dx on the left and right and dy at the top and bottom."""
        return Box(self.x - dx, self.y - dy, self.width + 2 * dx, self.height + 2 * dy)

    def union(self, other: Box) -> Box:
        """Return the smallest box that holds both."""
        left, top = min(self.x, other.x), min(self.y, other.y)
        right, bottom = max(self.right, other.right), max(self.bottom, other.bottom)
        return Box(left, top, right - left, bottom - top)

    def clipped(self, width: float, height: float) -> Box | None:
        """Return the part inside an image of the given size, None if there is none."""
        left, top = max(self.x, 0.0), max(self.y, 0.0)
        right, bottom = min(self.right, width), min(self.bottom, height)
        if right <= left or bottom <= top:
            return None
        return Box(left, top, right - left, bottom - top)

    def slices(self, width: int, height: int) -> tuple[slice, slice]:
        """
        Return the (row, column) slices of the pixels touched in an image of the given size.

        The slices are empty if the box lies outside.
        """
        left = min(max(math.floor(self.x), 0), width)
        top = min(max(math.floor(self.y), 0), height)
        right = min(max(math.ceil(self.right), left), width)
        bottom = min(max(math.ceil(self.bottom), top), height)
        return slice(top, bottom), slice(left, right)

    def iou(self, other: Box) -> float:
        """Return the intersection over union with another box, 0..1."""
        width = min(self.right, other.right) - max(self.x, other.x)
        height = min(self.bottom, other.bottom) - max(self.y, other.y)
        if width <= 0 or height <= 0:
            return 0.0
        common = width * height
        return common / (self.width * self.height + other.width * other.height - common)

    def corners(self) -> tuple[tuple[float, float], ...]:
        """Return the corners clockwise from the top left."""
        return (
            (self.x, self.y),
            (self.right, self.y),
            (self.right, self.bottom),
            (self.x, self.bottom),
        )


def check_start_box(box: Box, size: tuple[int, int]) -> None:
    """
    Refuse first boxes that cannot hold a person in view.

    :param box: in source pixels.
    :param size: width and height of the source image.
    :raises InputError: if the box lies outside of the image, or more than 4 images wide
        or high.
    """
    width, height = size
    image = f'the image of {width} x {height} pixels'
    if box.clipped(width, height) is None:
        raise InputError(f'box to start from must not lie outside of {image}, got {_told(box)}')
    if box.width > _LARGEST_START * width or box.height > _LARGEST_START * height:
        raise InputError(
            f'box to start from must be at most {_LARGEST_START:g} times as wide and high as '
            f'{image}, got {_told(box)}'
        )


def check_matched_box(box: Box, size: tuple[int, int]) -> None:
    """
    Refuse boxes that no tracker means, which would cost memory and time without limit.

    :param box: in source pixels.
    :param size: width and height of the source image.
    :raises InputError: if the box is smaller than half a pixel, or larger than or farther away
        than 8 times the longer side of the image.
    """
    most = FARTHEST * max(size)
    off_x, off_y = abs(box.center_x - size[0] / 2), abs(box.center_y - size[1] / 2)
    if (
        min(box.width, box.height) < _LEAST_MATCHED
        or max(box.width, box.height, off_x, off_y) > most
    ):
        raise InputError(
            f'box must be {_LEAST_MATCHED:g} to {most:g} pixels large and at most {most:g} pixels '
            f'from the centre of the image of {size[0]} x {size[1]}, got {_told(box)}'
        )


def _told(box: Box) -> str:
    return f'x {box.x:g}, y {box.y:g}, {box.width:g} x {box.height:g}'
