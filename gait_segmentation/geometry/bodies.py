# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies in an image: where they stand, how they lean, and what is about them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gait_segmentation.errors import InputError
from gait_segmentation.geometry.boxes import FARTHEST, Box

__all__ = ['BodyFrame', 'Placement', 'body_window', 'check_body']

_HALF_WIDTH, _HALF_HEIGHT, _HELD_MARGIN = 0.52, 0.62, 0.12
"""Reach of the window about a body, and its margin about a box held, in body heights."""


_BEYOND = 12.0
"""How much larger and farther away than its box a body may be, with any parameters of matching."""


@dataclass(frozen=True)
class BodyFrame:
    """
    Where a body stands in an image.

    ``center_x, center_y`` is the point at mid height on the body's axis and ``height`` the body's
    height along the axis, both in pixels; ``angle`` is the tilt of the axis in radians, positive
    when the head leans to the right in the image.
    """

    center_x: float
    center_y: float
    height: float
    angle: float = 0.0

    def scaled(self, factor: float) -> BodyFrame:
        """Return the same body in an image ``factor`` times the size."""
        return BodyFrame(
            self.center_x * factor, self.center_y * factor, self.height * factor, self.angle
        )

    def corners(self, width: float) -> tuple[tuple[float, float], ...]:
        """
        Return the rectangle along the axis, clockwise from the body's top left.

        :param width: width of the rectangle in pixels, across the axis.
        """
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        half_w, half_h = width / 2, self.height / 2
        return tuple(
            (self.center_x + cos * x - sin * y, self.center_y + sin * x + cos * y)
            for x, y in (
                (-half_w, -half_h),
                (half_w, -half_h),
                (half_w, half_h),
                (-half_w, half_h),
            )
        )

    @classmethod
    def from_corners(cls, corners: tuple[tuple[float, float], ...]) -> tuple[BodyFrame, float]:
        """
        Invert :meth:`corners`.

        :param corners: four (x, y), clockwise from the body's top left.
        :returns: the frame and the width of the rectangle.
        :raises InputError: if there are not four corners or the rectangle has no size.
        """
        if len(corners) != 4:
            raise InputError(f'a box must have 4 corners, got {len(corners)}')
        points = np.asarray(corners, dtype=np.float64)
        if not np.isfinite(points).all():
            raise InputError(f'box corners must be finite numbers, got {corners}')
        center = points.mean(axis=0)
        down = (points[3] + points[2] - points[0] - points[1]) / 2
        across = (points[1] + points[2] - points[0] - points[3]) / 2
        height, width = float(np.hypot(*down)), float(np.hypot(*across))
        if height <= 0 or width <= 0:
            raise InputError(f'box corners must span a rectangle, got {corners}')
        angle = math.atan2(-float(down[0]), float(down[1]))
        return cls(float(center[0]), float(center[1]), height, angle), width


@dataclass(frozen=True)
class Placement:
    """
    Where the template grid lies relative to the tracked box.

    ``dx, dy`` shift the centre, in heights of the box; ``scale`` is the height of the body over
    the height of the box.
    """

    dx: float
    dy: float
    scale: float

    def body(self, box: Box, angle: float = 0.0) -> BodyFrame:
        """Return the body frame this placement means for a box, in the box's pixels."""
        return BodyFrame(
            box.center_x + self.dx * box.height,
            box.center_y + self.dy * box.height,
            self.scale * box.height,
            angle,
        )


def check_body(body: BodyFrame, size: tuple[int, int]) -> None:
    """
    Refuse bodies that no matching means, which would cost memory and time without limit.

    :param body: in source pixels.
    :param size: width and height of the source image.
    :raises InputError: if a value is not finite, the height not positive, or the body larger than
        or farther away than 96 times the longer side of the image.
    """
    most = FARTHEST * _BEYOND * max(size)
    off_x, off_y = abs(body.center_x - size[0] / 2), abs(body.center_y - size[1] / 2)
    # Written so that what is no number is refused.
    if not (
        math.isfinite(body.angle) and 0 < body.height <= most and off_x <= most and off_y <= most
    ):
        raise InputError(
            f'body must be finite, at most {most:g} pixels high and from the centre of the image '
            f'of {size[0]} x {size[1]}, got x {body.center_x:g}, y {body.center_y:g}, '
            f'height {body.height:g}, angle {body.angle:g}'
        )


def body_window(center_x: float, center_y: float, height: float, held: Box | None = None) -> Box:
    """
    Return the window in which the pixels about a body are judged.

    :param center_x: x of the body's centre in pixels; ``center_y`` likewise.
    :param height: height of the body in pixels.
    :param held: a box that the window holds as well, with a margin.
    """
    # In plain numbers, since this is asked for several times a frame.
    left, right = center_x - _HALF_WIDTH * height, center_x + _HALF_WIDTH * height
    top, bottom = center_y - _HALF_HEIGHT * height, center_y + _HALF_HEIGHT * height
    if held is not None:
        margin = _HELD_MARGIN * height
        left, right = min(left, held.x - margin), max(right, held.right + margin)
        top, bottom = min(top, held.y - margin), max(bottom, held.bottom + margin)
    return Box(left, top, right - left, bottom - top)
