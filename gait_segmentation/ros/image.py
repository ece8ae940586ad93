# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Arrays as image messages; the other way is in ``inputs.encodings``.

Assigning an array to ``Image.data`` costs rclpy a check of every byte, so nothing here does.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image

if TYPE_CHECKING:
    from std_msgs.msg import Header

__all__ = ['image_message']


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
