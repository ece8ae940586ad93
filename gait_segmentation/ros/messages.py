# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Images, boxes and gait as messages: one place for what each field means."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import cv2
import numpy as np
from geometry_msgs.msg import Point32, PolygonInstanceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, JointState

from gait_segmentation.streams.fields import Corners, gait_joints

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.results import MatchResult

__all__ = ['box_message', 'compressed_message', 'gait_message', 'image_message']


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


def gait_message(match: MatchResult, header: Header) -> JointState:
    """Make the gait message of a match; it has no joints if nobody is tracked."""
    message = JointState(header=header)
    joints = map(list, gait_joints(match))
    message.name, message.position, message.velocity, message.effort = joints
    return message
