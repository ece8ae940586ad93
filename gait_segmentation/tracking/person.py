# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tracker knows of one person: place, size, outline and colours."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import ColourModel, body_rows, colour_bins
from gait_segmentation.geometry import BodyFrame, Box, body_window
from gait_segmentation.images import (
    Bounds,
    Window,
    axis_tilt,
    bounding_box,
    count_likely,
    distance_from,
    quantiles,
    shift_whole,
    size_of,
)
from gait_segmentation.tracking.cues import Cue
from gait_segmentation.tracking.records import Shift

_OUTERMOST = 0.005
"""Share of the pixels at each end that does not count."""


class Extent(NamedTuple):
    """
    How far a mask reaches from a point, along and across the body, in pixels.

    The outermost 0.5 % of the pixels do not count.  ``axis`` is the median across; ``at_bottom``
    tells that the mask ends at the lower border.
    """

    top: float
    bottom: float
    left: float
    right: float
    axis: float
    at_bottom: bool


def extent_of(
    mask: NDArray[np.uint8],
    center: tuple[float, float],
    angle: float,
    bounds: Bounds | None = None,
) -> Extent:
    """
    Measure how far a mask reaches from a point, along and across a body of that tilt.

    :param mask: (h, w) uint8, not all zero.
    :param bounds: of the mask, if they are known.
    """
    first, upper, width, height = bounding_box(mask) if bounds is None else bounds
    at_bottom = height > 0 and upper + height >= mask.shape[0] - 1
    rows, columns = np.nonzero(mask[upper : upper + height, first : first + width])
    right, down = columns + (first + 0.5 - center[0]), rows + (upper + 0.5 - center[1])
    cos, sin = math.cos(angle), math.sin(angle)
    along, across = cos * down - sin * right, cos * right + sin * down
    top, bottom = quantiles(along, (_OUTERMOST, 1 - _OUTERMOST))
    left, axis, far = quantiles(across, (_OUTERMOST, 0.5, 1 - _OUTERMOST))
    return Extent(top - 0.5, bottom + 0.5, left - 0.5, far + 0.5, axis, at_bottom)


GUARD = 0.05
"""How far outside of the last mask or the template pixels are the person's, in body heights."""

LEAST_SEEN = 0.25
"""Share of a person below which nothing can be told: neither learnt nor followed."""

WHOLE = 0.75
"""Share of the usual area from which a mask shows all of the person, and so is followed."""

_AREA_RATE = 0.02
"""
Share by which the usual area moves towards that of a mask: of one of all of the person or not, or
nothing would be learnt after a first mask that was far too large.
"""

_MOST_SEEN = 4.0
"""Size of a mask, over that of the template, from which it is of more than the person."""

_POSE_RATE, _VELOCITY_RATE = 0.1, 0.2
"""Share by which height and tilt, and the pace, move towards what a mask or a frame shows."""

_LEAST_STEP_S = 0.02
"""Frames whose stamps are closer were not taken in so short a time: they tell no pace."""

WIDEST = 0.6
"""Widest silhouette, in body heights."""

_MOST_GROWTH = 1.15
"""
The most by which the height changes with a mask, and by which somebody grows who is cut off by
the lower border, of whom only the least height can be seen.
"""

_BEYOND = 0.3
"""How far outside of the image the centre of somebody is expected at most, in body heights."""

_TILT_ON, _TILT_OFF, _MOST_TILT = 0.16, 0.10, 0.5
"""Tilt from which and down to which it is used, and the largest, in radians."""


@dataclass
class Person:
    """
    State of one tracked person in working pixels.

    ``left`` and ``right`` are how far the silhouette reaches from the body's axis.  ``velocity``
    is relative to the still world, in pixels per second.
    ``tilt`` is the estimate of how far the axis leans, in radians, and ``angle`` what is used of
    it.  ``masks`` counts the masks the tilt was learnt
    from; ``mask_height`` is the height at the last mask.  ``template`` is the template, (h, w)
    uint8, that came with ``mask``, None if none did; ``part`` is (h, w) uint8, what can be
    followed of what the very last mask showed, while ``mask`` is the last of all of the person;
    ``usual_area`` is that of their masks in squared heights;
    ``rest`` is by how much they lag behind the body, in pixels.  ``moves`` counts the
    frames that the velocity was learnt from.
    """

    center_x: float
    center_y: float
    height: float
    left: float
    right: float
    mask: NDArray[np.uint8]
    person: ColourModel
    surroundings: ColourModel
    velocity: Shift = (0.0, 0.0)
    tilt: float = 0.0
    angle: float = 0.0
    masks: int = 0
    mask_height: float = 0.0
    template: NDArray[np.uint8] | None = None
    part: NDArray[np.uint8] = field(init=False)
    rest: Shift = (0.0, 0.0)
    moves: int = 0
    cues: tuple[Cue, ...] = ()
    usual_area: float = field(init=False)

    def __post_init__(self) -> None:
        """Take the first height for that of the first mask, which is followed at first."""
        self.mask_height = self.height
        self.part = self.mask
        self.usual_area = self._area_of(self.mask)

    @property
    def box(self) -> Box:
        """Return the tight box in the frame of the body: turned by ``angle`` about its centre."""
        return Box(
            self.center_x - self.left,
            self.center_y - self.height / 2,
            self.left + self.right,
            self.height,
        )

    @property
    def area(self) -> Box:
        """Return the box about the person that is kept out of what is learnt of the world."""
        return Box.from_center(self.center_x, self.center_y, 0.7 * self.height, self.height)

    def window(self, shape: tuple[int, int]) -> Window:
        """Return the rows and columns in which pixels are judged."""
        around = body_window(self.center_x, self.center_y, self.height, self.box)
        return around.slices(shape[1], shape[0])

    def rows(self, window: Window) -> NDArray[np.float32]:
        """Return how far down the body each pixel of a window lies, 0 to 1."""
        origin, center = (window[1].start, window[0].start), (self.center_x, self.center_y)
        return body_rows(size_of(window), origin, center, self.height, self.angle)

    def share_inside(self, shape: tuple[int, int]) -> float:
        """Return the share of the body's box that lies in an image of the given (h, w)."""
        box = self.box
        across = min(box.right, shape[1]) - max(box.x, 0.0)
        down = min(box.bottom, shape[0]) - max(box.y, 0.0)
        return 0.0 if min(across, down) <= 0 else across * down / (box.width * box.height)

    def shift(self, dx: float, dy: float) -> None:
        """Move the person."""
        self.center_x += dx
        self.center_y += dy

    def keep_near(self, shape: tuple[int, int]) -> Shift:
        """
        Move the person back to where somebody outside of an image can be at most.

        :param shape: (h, w) of the image.
        :returns: the shift made.
        """
        beyond = _BEYOND * self.height
        dx = min(max(self.center_x, -beyond), shape[1] + beyond) - self.center_x
        dy = min(max(self.center_y, -beyond), shape[0] + beyond) - self.center_y
        self.shift(dx, dy)
        return dx, dy

    def carry(self, dx: float, dy: float) -> None:
        """Carry mask and template on by whole pixels; what is left over counts the next time."""
        x, y = self.rest[0] + dx, self.rest[1] + dy
        whole = (round(x), round(y))
        self.rest = (x - whole[0], y - whole[1])
        self.mask, self.part = shift_whole(self.mask, *whole), shift_whole(self.part, *whole)
        if self.template is not None:
            self.template = shift_whole(self.template, *whole)

    def take(self, mask: NDArray[np.uint8], template: NDArray[np.uint8] | None) -> None:
        """Take over a mask (0/255) of all of the person and its template, (h, w) uint8."""
        self.mask = self.part = mask
        self.template, self.rest = template, (0.0, 0.0)

    def way(self, seconds: float) -> Shift:
        """Return how far the person goes against the still world in a time, in pixels."""
        seconds = max(seconds, _LEAST_STEP_S)
        return self.velocity[0] * seconds, self.velocity[1] * seconds

    def move(self, world: Shift, body: Shift | None, seconds: float) -> Shift:
        """
        Move the person by the measured shift of the body, or as it moved before.

        :param world: shift of the still world at the person.
        :param body: measured shift of the body in the image, None if unknown.
        :param seconds: between the two frames.
        :returns: the shift made.
        """
        if body is None:
            x, y = self.way(seconds)
            body = (world[0] + x, world[1] + y)
        else:
            self.learn_pace(world, body, seconds)
        self.shift(*body)
        return body

    def forget_pace(self) -> None:
        """Take the person for standing until steps are seen again."""
        self.velocity, self.moves = (0.0, 0.0), 0

    def learn_pace(self, world: Shift, body: Shift, seconds: float) -> None:
        """Learn the velocity from a shift of the body; see :meth:`move`."""
        if seconds < _LEAST_STEP_S:
            return
        self.moves += 1
        rate = max(_VELOCITY_RATE, 1 / self.moves)
        x, y = ((b - w) / seconds - v for b, w, v in zip(body, world, self.velocity, strict=True))
        self.velocity = (self.velocity[0] + rate * x, self.velocity[1] + rate * y)

    def learn_colours(
        self,
        lab: NDArray[np.uint8],
        window: Window,
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8] | None,
        rates: tuple[float, float],
        familiar: NDArray[np.bool_] | None = None,
    ) -> None:
        """
        Learn the colours of person and surroundings from a mask.

        The person's are those of the mask near the template, outside of which they must not look
        as the surroundings do there, or as a shadow on them: a mask that takes in the shadow at
        the feet would teach that it is the person's, and take in more of it.  The surroundings'
        are those that do not touch the mask.

        :param lab: (h, w, 3) uint8, the person's window of the working image.
        :param mask: (H, W) uint8 0/255.
        :param template: (H, W) uint8, above 127 on the body; None, or without a body: not known.
        :param rates: shares of this frame, for the person and for the surroundings.
        :param familiar: (h, w) bool, where the surroundings are known to look like this.
        """
        part = mask[window]
        bins, rows = colour_bins(np.ascontiguousarray(lab)), self.rows(window)
        inside, outside = part > 127, cv2.dilate(part, np.ones((3, 3), np.uint8)) <= 127
        if template is not None:
            body = template[window] > 127
            if body.any():
                inside &= distance_from(body) < GUARD * self.height
            if familiar is not None:
                inside &= body | ~familiar
        self.person.learn(bins, rows, inside, rates[0])
        self.surroundings.learn(bins, rows, outside, rates[1])

    def learn_first_colours(self, lab: NDArray[np.uint8], votes: NDArray[np.float32]) -> None:
        """
        Learn the colours of person and surroundings from a first mask that is not sure.

        What may be either counts for both, so that a leg missed at first can still be found.

        :param lab: (h, w, 3) uint8, the working image.
        :param votes: (h, w) float32, P(person) in 0..1.
        """
        window = self.window(votes.shape)
        bins, rows = colour_bins(np.ascontiguousarray(lab[window])), self.rows(window)
        inside = np.ascontiguousarray(votes[window])
        self.person.learn(bins, rows, inside, 1.0)
        outside = cv2.erode(1 - inside, np.ones((3, 3), np.uint8))
        self.surroundings.learn(bins, rows, outside, 1.0)

    def learn_place(
        self,
        mask: NDArray[np.uint8],
        body: BodyFrame | None,
        bounds: Bounds | None = None,
    ) -> None:
        """
        Correct place and size from a mask and the matched body.

        :param mask: (h, w) uint8 0/255 of the working image.
        :param body: the matched body in working pixels.
        :param bounds: of the mask, if they are known.
        """
        extent = extent_of(mask, (self.center_x, self.center_y), self.angle, bounds)
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        tall, middle = extent.bottom - extent.top, (extent.top + extent.bottom) / 2
        template_height, template_across, template_along = tall, extent.axis, middle
        if body is not None:
            dx, dy = body.center_x - self.center_x, body.center_y - self.center_y
            template_height = body.height
            template_across = cos * dx + sin * dy
            template_along = cos * dy - sin * dx
        mean = 0.5 * template_height + 0.5 * tall
        goal = max(template_height, tall) if extent.at_bottom else mean
        goal = min(max(goal, self.height / _MOST_GROWTH), _MOST_GROWTH * self.height)
        self.height += _POSE_RATE * (goal - self.height)
        if extent.at_bottom:
            # More of the body is below the border: it is at least as tall as that.
            least = max(tall, (extent.right - extent.left) / WIDEST)
            self.height = max(self.height, min(least, _MOST_GROWTH * self.mask_height))
            along = extent.top + self.height / 2
        else:
            along = 0.5 * middle + 0.25 * template_along
        across = 0.3 * template_across + 0.3 * extent.axis
        self.shift(cos * across - sin * along, sin * across + cos * along)
        self.mask_height = self.height
        self.left = max(across - extent.left, 1.0)
        self.right = max(extent.right - across, 1.0)

    def follow_scale(self, scale: float) -> None:
        """Follow the size that mean shift measured, over that in the last mask."""
        self.grow(self.mask_height * min(max(scale, 1 / _MOST_GROWTH), _MOST_GROWTH) / self.height)

    def grow(self, ratio: float) -> None:
        """Follow a change of size: height now over height so far."""
        change = max(1 + _POSE_RATE * (ratio - 1), 1 / self.height)
        self.height *= change
        self.left *= change
        self.right *= change

    def learn_angle(self, mask: NDArray[np.uint8], bounds: Bounds | None = None) -> None:
        """
        Follow the tilt of the body: the main axis of the masks, averaged over steps.

        The tilt is used only once it is large, and then until it is small again, because on
        upright people bags and shadows would pull it about.

        :param mask: (h, w) uint8 0/255 of the working image.
        :param bounds: of the mask, if they are known.
        """
        x, y, width, height = bounding_box(mask) if bounds is None else bounds
        if height > 0 and (y < 2 or y + height > mask.shape[0] - 2):
            return
        tilt = axis_tilt(mask[y : y + height, x : x + width])
        self.masks += 1
        rate = max(_POSE_RATE, 1 / self.masks)
        self.tilt += rate * (min(max(tilt, -_MOST_TILT), _MOST_TILT) - self.tilt)
        threshold = _TILT_OFF if self.angle else _TILT_ON
        self.angle = self.tilt if abs(self.tilt) > threshold else 0.0

    def shows_all(self, mask: NDArray[np.uint8]) -> bool:
        """Get used to the size of a mask; return whether it was large enough for all of them."""
        area = self._area_of(mask)
        share = area / max(self.usual_area, 1e-6)
        self.usual_area += _AREA_RATE * (area - self.usual_area)
        return share >= WHOLE

    def _area_of(self, mask: NDArray[np.uint8]) -> float:
        """Return the area of a mask in squared body heights, made up for what is outside."""
        inside = max(self.share_inside(mask.shape), 0.1)
        return count_likely(mask) / (inside * self.height**2)

    def teaches(self, mask: NDArray[np.uint8], prior: NDArray[np.uint8]) -> bool:
        """Return whether a mask is of the size of a person, beside the template."""
        window = self.window(mask.shape)
        area, template = cv2.countNonZero(mask[window]), count_likely(prior[window])
        return max(LEAST_SEEN * template, 9) < area < _MOST_SEEN * max(template, 9)
