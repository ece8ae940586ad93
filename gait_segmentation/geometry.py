# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Boxes, body frames and the transforms between template, working image and source image.

Coordinates
    Image coordinates have x to the right and y down.  A *length* or *position* is continuous:
    the pixel in column 0 covers x from 0 to 1 and its centre is at x = 0.5, so a position is
    scaled from one image size to another by multiplying with the ratio of the sizes, and by
    nothing else.  ``cv2`` counts pixel centres as integers instead; :func:`pixel_affine` turns a
    transform of positions into the matrix ``cv2.warpAffine`` wants.

Sizes
    *Source* size is the camera's; *working* size is what the likelihood and the shape prior
    have.  The width of a working image over the width of the source is the scale.

Body frame
    Templates live in the frame of the body: origin at mid height on the body's axis, x to the
    right, y down, unit the height of the body.  A template grid of H x W pixels with ``fill`` f
    covers H/(f H) = 1/f body heights vertically.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

# Least height of a first box in pixels, and its size, in image sizes, above which it cannot be
# that of a person in view.
_LEAST_START = 8
_LARGEST_START = 4.0
# Least size of a box to match in pixels, and its largest size and distance in the image's longer
# sides: beyond what a tracker makes of the smallest and the largest box to start from.
_LEAST_MATCHED, _MOST_SIDES = 0.5, 8.0
# How much larger and farther away than its box a body may be, with any parameters of matching.
_BODY_BEYOND = 12.0

REACH = 0.12
"""How far about the outline of a person it is asked whose pixels are, in body heights."""

# Reach of the window about a body, and its margin about a box held, in body heights.
_HALF_WIDTH, _HALF_HEIGHT, _HELD_MARGIN = 0.52, 0.62, 0.12


@dataclass(frozen=True)
class Box:
    """
    An upright rectangle in pixels: top left corner, width and height, all sub-pixel.

    The other edges and the centre follow from these.

    :raises InputError: if a value is not finite or width or height is not positive.
    """

    x: float
    y: float
    width: float
    height: float
    right: float = field(init=False, repr=False, compare=False)
    bottom: float = field(init=False, repr=False, compare=False)
    center_x: float = field(init=False, repr=False, compare=False)
    center_y: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values = (self.x, self.y, self.width, self.height)
        if not all(map(math.isfinite, values)):
            raise InputError(f'box values must be finite numbers, got {values}')
        if self.width <= 0 or self.height <= 0:
            raise InputError(
                f'box width and height must be positive, got {self.width:g} x {self.height:g}'
            )

        # Once, since every frame asks for them a hundred times.
        vars(self).update(
            right=self.x + self.width,
            bottom=self.y + self.height,
            center_x=self.x + self.width / 2,
            center_y=self.y + self.height / 2,
        )

    @classmethod
    def from_center(cls, center_x: float, center_y: float, width: float, height: float) -> Box:
        """Make a box from its centre and size."""
        return cls(center_x - width / 2, center_y - height / 2, width, height)

    @classmethod
    def around(cls, mask: NDArray[np.uint8] | NDArray[np.bool_]) -> Box | None:
        """Return the tight box of what is not zero of a (height, width) mask, None if all is."""
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

    def slices(self, width: int, height: int, margin: float = 0.0) -> tuple[slice, slice]:
        """Return the (row, column) slices of pixels touched, with a margin; empty outside."""
        left = min(max(math.floor(self.x - margin), 0), width)
        top = min(max(math.floor(self.y - margin), 0), height)
        right = min(max(math.ceil(self.right + margin), left), width)
        bottom = min(max(math.ceil(self.bottom + margin), top), height)
        return slice(top, bottom), slice(left, right)

    def iou(self, other: Box) -> float:
        """Return the intersection over union with another box, 0..1."""
        width = min(self.right, other.right) - max(self.x, other.x)
        height = min(self.bottom, other.bottom) - max(self.y, other.y)
        if width <= 0 or height <= 0:
            return 0.0
        common = width * height
        return common / (self.width * self.height + other.width * other.height - common)

    def common_share(self, other: Box) -> float:
        """Return the share of the smaller of two boxes that both have in common, 0..1."""
        width = min(self.right, other.right) - max(self.x, other.x)
        height = min(self.bottom, other.bottom) - max(self.y, other.y)
        smaller = min(self.width * self.height, other.width * other.height)
        return width * height / smaller if min(width, height) > 0 else 0.0

    def corners(self) -> tuple[tuple[float, float], ...]:
        """Return the corners clockwise from the top left."""
        return (
            (self.x, self.y),
            (self.right, self.y),
            (self.right, self.bottom),
            (self.x, self.bottom),
        )


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

    def shifted(self, dx: float, dy: float) -> BodyFrame:
        """Return the body moved by (dx, dy)."""
        return replace(self, center_x=self.center_x + dx, center_y=self.center_y + dy)

    @property
    def feet(self) -> tuple[float, float]:
        """Return the lower end of the axis."""
        half = self.height / 2
        return (
            self.center_x - math.sin(self.angle) * half,
            self.center_y + math.cos(self.angle) * half,
        )

    def corners(self, width: float) -> tuple[tuple[float, float], ...]:
        """Return the rectangle of a width across the axis, clockwise from the body's top left."""
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        upright = Box(-width / 2, -self.height / 2, width, self.height)
        return tuple(
            (self.center_x + cos * x - sin * y, self.center_y + sin * x + cos * y)
            for x, y in upright.corners()
        )

    @classmethod
    def from_corners(cls, corners: tuple[tuple[float, float], ...]) -> tuple[BodyFrame, float]:
        """
        Invert :meth:`corners`.

        :param corners: four (x, y), clockwise from the body's top left.
        :returns: the frame and the width of the rectangle.
        :raises InputError: if there are not four corners or the rectangle has no size.
        """
        points = np.asarray(corners, dtype=np.float64)
        if points.shape != (4, 2) or not np.isfinite(points).all():
            raise InputError(f'a box must have 4 corners of finite numbers, got {corners}')
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


def check_start_box(box: Box, size: tuple[int, int]) -> None:
    """
    Refuse first boxes that cannot hold a person in view.

    :param box: in source pixels.
    :param size: width and height of the source image.
    :raises InputError: if the box lies outside of the image by half, as corners do that are taken
        for a size, is less than 8 pixels high, as shares of the image are, or more than 4 images
        wide or high.
    """
    width, height = size
    image = f'the image of {width} x {height} pixels'
    inside = 0 < box.center_x < width and 0 < box.center_y < height
    if not inside or box.height < min(_LEAST_START, height):
        raise InputError(
            'box to start from must be x, y, width, height in pixels, at least '
            f'{_LEAST_START} high, and not lie outside of {image} by half, got {_told(box)}'
        )
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
    most = _MOST_SIDES * max(size)
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


def check_body(body: BodyFrame, size: tuple[int, int]) -> None:
    """
    Refuse bodies that no matching means, which would cost memory and time without limit.

    :param body: in source pixels.
    :param size: width and height of the source image.
    :raises InputError: if a value is not finite, the height not positive, or the body larger than
        or farther away than 96 times the longer side of the image.
    """
    most = _MOST_SIDES * _BODY_BEYOND * max(size)
    off_x, off_y = abs(body.center_x - size[0] / 2), abs(body.center_y - size[1] / 2)
    # Written so that what is no number is refused.
    near = body.height <= most and off_x <= most and off_y <= most
    if not (near and body.height > 0 and math.isfinite(body.angle)):
        raise InputError(
            f'body must be finite, at most {most:g} pixels high and from the centre of the image '
            f'of {size[0]} x {size[1]}, got x {body.center_x:g}, y {body.center_y:g}, '
            f'height {body.height:g}, angle {body.angle:g}'
        )


def body_window(center_x: float, center_y: float, height: float, held: Box | None = None) -> Box:
    """
    Return the window in which the pixels about a body are judged.

    :param center_x, center_y: the body's centre in pixels.
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


def reach(transform: NDArray[np.float64], width: float, height: float) -> Box:
    """Return how far a grid from (0, 0) on reaches where a 2 x 3 transform lays it."""
    (a, b, x), (c, d, y) = transform.tolist()
    a, b, c, d = a * width, b * height, c * width, d * height
    left, top = x + min(a, 0.0) + min(b, 0.0), y + min(c, 0.0) + min(d, 0.0)
    return Box(left, top, abs(a) + abs(b), abs(c) + abs(d))


def pixel_affine(transforms: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Turn (..., 2, 3) transforms of positions into those of pixel indices, for ``cv2.warpAffine``.

    Pixel (i, j) has its centre at position (i + 0.5, j + 0.5).
    """
    result = transforms.copy()
    result[..., 2] += 0.5 * transforms[..., :2].sum(axis=-1) - 0.5
    return result


def template_to_image(
    body: BodyFrame, rows: int, columns: int, height: float
) -> NDArray[np.float64]:
    """
    Return the 2 x 3 transform from positions on a template grid to positions in the image.

    :param body: the body frame in the image's pixels.
    :param rows, columns: of the grid, in whose middle the body stands.
    :param height: of the body on the grid, in its pixels.
    """
    step = body.height / height
    cos, sin = step * math.cos(body.angle), step * math.sin(body.angle)
    center_x, center_y = columns / 2, rows / 2
    return np.array(
        [
            [cos, -sin, body.center_x - cos * center_x + sin * center_y],
            [sin, cos, body.center_y - sin * center_x - cos * center_y],
        ]
    )
