# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Images, boxes and gait as messages: one place for what each field means."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from geometry_msgs.msg import Point32, PolygonInstanceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, JointState

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.streams.fields import GAIT_NAMES, Corners, gait_joints

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.results import MatchResult

__all__ = [
    'GAIT_NAMES',
    'Gait',
    'box_message',
    'compressed_message',
    'gait_message',
    'image_message',
    'points_of',
    'read_body',
    'read_box',
    'read_gait',
    'stamp_of',
]

_MOST_TILT = math.pi / 4


def stamp_of(header: Header) -> int:
    """Return the stamp of a header in nanoseconds."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def image_message(image: NDArray[np.uint8], header: Header) -> Image:
    """
    Make a message from an array.

    :param image: (height, width) for ``mono8`` or (height, width, 3) for ``bgr8``, uint8.
    :param header: the header of the source image, taken over as it is.
    """
    message = Image()
    message.header = header
    message.height, message.width = image.shape[:2]
    message.encoding = 'mono8' if image.ndim == 2 else 'bgr8'
    message.step = message.width * (1 if image.ndim == 2 else 3)
    message.is_bigendian = int(sys.byteorder == 'big')
    # The only fast way: assigning an array, bytes or a memoryview checks every element.
    if image.size:
        message.data.frombytes(np.ascontiguousarray(image).data.cast('B'))
    return message


def compressed_message(image: NDArray[np.uint8], header: Header) -> CompressedImage:
    """
    Make a message of a PNG from a mask, and of a JPEG from a picture; without pixels it is empty.

    :param image: see :func:`image_message`; ``header`` likewise.
    """
    grey = image.ndim == 2
    message = CompressedImage(header=header)
    message.format = 'mono8; png compressed ' if grey else 'bgr8; jpeg compressed bgr8'
    if image.size:
        quick = [cv2.IMWRITE_PNG_COMPRESSION, 1] if grey else []
        _, data = cv2.imencode('.png' if grey else '.jpg', image, quick)
        message.data.frombytes(data.data.cast('B'))
    return message


def box_message(corners: Corners, track_id: int, header: Header) -> PolygonInstanceStamped:
    """
    Make a message from corners in source pixels.

    :param corners: four (x, y) clockwise from the top left, none if nobody is tracked.
    """
    message = PolygonInstanceStamped(header=header)
    message.polygon.id = track_id
    message.polygon.polygon.points = [Point32(x=float(x), y=float(y)) for x, y in corners]
    return message


def points_of(message: PolygonInstanceStamped) -> Corners:
    """
    Return the corners of a box message, none if nobody is tracked.

    :raises InputError: if there are neither 0 nor 4 points, or one is not finite.
    """
    points = tuple((point.x, point.y) for point in message.polygon.polygon.points)
    if len(points) not in (0, 4):
        raise InputError(f'a box must have 4 points, or none for nobody, got {len(points)}')
    if not all(math.isfinite(value) for point in points for value in point):
        raise InputError(f'box points must be finite, got {points}')
    return points


def read_box(message: PolygonInstanceStamped) -> tuple[Box | None, float]:
    """
    Return the box in the frame of the body and the body's tilt in radians.

    Corners in another order than clockwise from the body's top left make an upright box.

    :returns: None and 0 if nobody is tracked.
    :raises InputError: see :func:`points_of`; also if the box has no size.
    """
    points = points_of(message)
    if not points:
        return None, 0.0
    body, width = BodyFrame.from_corners(points)
    if abs(body.angle) < _MOST_TILT:
        return Box.from_center(body.center_x, body.center_y, width, body.height), body.angle
    columns = [x for x, _ in points]
    rows = [y for _, y in points]
    left, top = min(columns), min(rows)
    return Box(left, top, max(columns) - left, max(rows) - top), 0.0


def read_body(message: PolygonInstanceStamped) -> BodyFrame | None:
    """
    Return the body a matched box stands for, None if nobody is tracked.

    :raises InputError: see :func:`points_of`; also if the rectangle has no size.
    """
    points = points_of(message)
    return BodyFrame.from_corners(points)[0] if points else None


def gait_message(match: MatchResult, header: Header) -> JointState:
    """Make the gait message of a match; it has no joints if nobody is tracked."""
    message = JointState(header=header)
    joints = map(list, gait_joints(match))
    message.name, message.position, message.velocity, message.effort = joints
    return message


class Gait(NamedTuple):
    """
    What a gait message says.

    ``phase`` is in strides [0, 1), ``rate`` in strides per second, ``azimuth`` in radians and
    ``similarity``, of the matched template with the likelihood, in 0..1.
    """

    phase: float
    rate: float
    azimuth: float
    similarity: float


def read_gait(message: JointState) -> Gait:
    """
    Return what a gait message says; all is 0 if it has no joints.

    A message without efforts does not say how similar the template is: it is believed.

    :raises InputError: if joints are missing or have no position, or a number is not finite.
    """
    if not message.name:
        return Gait(0.0, 0.0, 0.0, 0.0)
    named = dict(zip(message.name, range(len(message.position)), strict=False))
    missing = [name for name in GAIT_NAMES if name not in named]
    if missing:
        raise InputError(
            f'gait must have positions of {" and ".join(GAIT_NAMES)}, got {list(message.name)} '
            f'with {len(message.position)} positions'
        )
    phase, azimuth = (named[name] for name in GAIT_NAMES)
    rate = message.velocity[phase] if len(message.velocity) > phase else 0.0
    similarity = message.effort[azimuth] if len(message.effort) > azimuth else 1.0
    numbers = message.position[phase], rate, message.position[azimuth], similarity
    if not all(map(math.isfinite, numbers)):
        raise InputError(f'the numbers of a gait must be finite, got {numbers}')
    turn = 2 * math.pi
    return Gait((numbers[0] / turn) % 1.0, numbers[1] / turn, *numbers[2:])
