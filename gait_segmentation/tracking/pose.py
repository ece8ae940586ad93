# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a tracked body is, how large, how it leans, and how fast it goes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import Window, axis_tilt, bounding_box, quantiles, size_of
from gait_segmentation.scene.scene import Shift
from gait_segmentation.tracking.pixels import OUTERMOST

_POSE_RATE, _VELOCITY_RATE = 0.1, 0.2
"""Share by which height and tilt, and the velocity, move towards what a mask or a frame shows."""

_LEAST_STEP_S = 0.02
"""Frames whose stamps are closer were not taken in so short a time: they tell no velocity."""

WIDEST_BODY = 0.6
"""Widest silhouette, in body heights."""

_MOST_GROWTH = 1.15
"""
The most by which the height changes with a mask, and by which a person grows who is cut off by
the lower border, of whom only the least height can be seen.
"""

_TILT_ON, _TILT_OFF, _MOST_TILT = 0.16, 0.10, 0.5
"""Tilt from which and down to which it is used, and the largest, in radians."""


@dataclass(frozen=True)
class Pose:
    """
    Place, size, tilt and velocity of a body in working pixels.

    ``left`` and ``right`` are how far the silhouette reaches from the body's axis.  ``velocity``
    is relative to the still world, in pixels per second, learnt from ``moves`` frames.  ``tilt``
    is the estimate of how far the axis leans, in radians, learnt from ``masks`` masks, and
    ``angle`` what is used of it.  ``mask_height`` is the height at the last mask.
    """

    center_x: float
    center_y: float
    height: float
    left: float
    right: float
    tilt: float = 0.0
    angle: float = 0.0
    velocity: Shift = (0.0, 0.0)
    moves: int = 0
    masks: int = 0
    mask_height: float = 0.0

    @classmethod
    def of(cls, body: BodyFrame, box: Box, tilt: float = 0.0) -> Pose:
        """Return the pose of a body in a tight box."""
        left, right = body.center_x - box.x, box.right - body.center_x
        x, y, height = body.center_x, body.center_y, body.height
        sides = max(left, 1.0), max(right, 1.0)
        return cls(x, y, height, *sides, tilt, tilt, mask_height=height)

    @cached_property
    def box(self) -> Box:
        """Return the tight box in the frame of the body: turned by ``angle`` about its centre."""
        width, top = self.left + self.right, self.center_y - self.height / 2
        return Box(self.center_x - self.left, top, width, self.height)

    @property
    def area(self) -> Box:
        """Return the box about the person that is kept out of what is learnt of the world."""
        return Box.from_center(self.center_x, self.center_y, 0.7 * self.height, self.height)

    @property
    def feet(self) -> float:
        """Return the row of the soles: the lower, the nearer."""
        return self.center_y + self.height / 2

    def rows(self, window: Window) -> NDArray[np.float32]:
        """Return how far down the body each pixel of a window lies, 0 to 1, (h, w)."""
        origin, center = (window[1].start, window[0].start), (self.center_x, self.center_y)
        return body_rows(size_of(window), origin, center, self.height, self.angle)

    def share_inside(self, shape: tuple[int, int]) -> float:
        """Return the share of the body's box that lies in an image of the given (h, w)."""
        box = self.box
        across = min(box.right, shape[1]) - max(box.x, 0.0)
        down = min(box.bottom, shape[0]) - max(box.y, 0.0)
        return 0.0 if min(across, down) <= 0 else across * down / (box.width * box.height)

    def shifted(self, dx: float, dy: float) -> Pose:
        """Return it moved; itself, with what is known of its box, if it stays."""
        if not (dx or dy):
            return self
        return replace(self, center_x=self.center_x + dx, center_y=self.center_y + dy)

    def outside_by(self, shape: tuple[int, int]) -> Shift:
        """Return the shift back to where the widest silhouette touches an image of (h, w)."""
        beyond = WIDEST_BODY / 2 * self.height
        dx = min(max(self.center_x, -beyond), shape[1] + beyond) - self.center_x
        dy = min(max(self.center_y, -beyond), shape[0] + beyond) - self.center_y
        return dx, dy

    def step(self, seconds: float) -> Shift:
        """Return how far the body goes against the still world in a time, in pixels."""
        seconds = max(seconds, _LEAST_STEP_S)
        return self.velocity[0] * seconds, self.velocity[1] * seconds

    def with_step(self, world: Shift, body: Shift, seconds: float) -> Pose:
        """
        Return it with the velocity corrected by a measured shift of the body.

        :param world: shift of the still world at the body.
        :param body: shift of the body in the image.
        :param seconds: between the two frames.
        """
        if seconds < _LEAST_STEP_S:
            return self
        rate = max(_VELOCITY_RATE, 1 / (self.moves + 1))
        x, y = self.velocity
        x += rate * ((body[0] - world[0]) / seconds - x)
        y += rate * ((body[1] - world[1]) / seconds - y)
        return replace(self, velocity=(x, y), moves=self.moves + 1)

    def standing(self) -> Pose:
        """Return it as of a person who stands until they are seen to move again."""
        return replace(self, velocity=(0.0, 0.0), moves=0)

    def fitted(self, mask: NDArray[np.uint8], body: BodyFrame | None) -> Pose:
        """
        Return it with place and size corrected by a mask and the matched body.

        :param mask: (h, w) uint8 0/255 of the working image, not all zero.
        :param body: the matched body in working pixels.
        """
        x, y, width, tall = bounding_box(mask)
        at_bottom = y + tall >= mask.shape[0] - 1
        rows, columns = np.nonzero(mask[y : y + tall, x : x + width])
        # How far it reaches from the centre, along and across the body.
        across, along = columns + (x + 0.5 - self.center_x), rows + (y + 0.5 - self.center_y)
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        top, bottom = quantiles(cos * along - sin * across, (OUTERMOST, 1 - OUTERMOST))
        left, axis, right = quantiles(cos * across + sin * along, (OUTERMOST, 0.5, 1 - OUTERMOST))
        top, bottom, left, right = top - 0.5, bottom + 0.5, left - 0.5, right + 0.5
        seen, middle = bottom - top, (top + bottom) / 2
        template_height, template_across, template_along = seen, axis, middle
        if body is not None:
            dx, dy = body.center_x - self.center_x, body.center_y - self.center_y
            template_height = body.height
            template_across = cos * dx + sin * dy
            template_along = cos * dy - sin * dx
        mean = 0.5 * template_height + 0.5 * seen
        goal = max(template_height, seen) if at_bottom else mean
        goal = min(max(goal, self.height / _MOST_GROWTH), _MOST_GROWTH * self.height)
        height = self.height + _POSE_RATE * (goal - self.height)
        if at_bottom:
            # More of the body is below the border: it is at least as tall as that.
            least = max(seen, (right - left) / WIDEST_BODY)
            height = max(height, min(least, _MOST_GROWTH * self.mask_height))
            down = top + height / 2
        else:
            down = 0.5 * middle + 0.25 * template_along
        aside = 0.3 * template_across + 0.3 * axis
        return replace(
            self,
            center_x=self.center_x + cos * aside - sin * down,
            center_y=self.center_y + (sin * aside + cos * down),
            height=height,
            left=max(aside - left, 1.0),
            right=max(right - aside, 1.0),
            mask_height=height,
        )

    def grown(self, ratio: float) -> Pose:
        """Return it as it follows a change of size: height now over height so far."""
        change = max(1 + _POSE_RATE * (ratio - 1), 1 / self.height)
        height, left, right = (change * each for each in (self.height, self.left, self.right))
        return replace(self, height=height, left=left, right=right)

    def tilted(self, mask: NDArray[np.uint8]) -> Pose:
        """
        Return it with the tilt of a mask: its main axis, averaged over steps.

        The tilt is used only once it is large, and then until it is small again, because on
        upright people bags and shadows would pull it about.

        :param mask: (h, w) uint8 0/255 of the working image.
        """
        x, y, width, height = bounding_box(mask)
        if height > 0 and (y < 2 or y + height > mask.shape[0] - 2):
            return self
        measured = axis_tilt(mask[y : y + height, x : x + width])
        rate = max(_POSE_RATE, 1 / (self.masks + 1))
        tilt = self.tilt + rate * (min(max(measured, -_MOST_TILT), _MOST_TILT) - self.tilt)
        angle = tilt if abs(tilt) > (_TILT_OFF if self.angle else _TILT_ON) else 0.0
        return replace(self, tilt=tilt, angle=angle, masks=self.masks + 1)
