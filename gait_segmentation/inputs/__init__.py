# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where frames come from: films, folders of images, and the bags of ROS 1 and ROS 2."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs.bag import BagSource, is_bag
from gait_segmentation.inputs.film import FilmSource
from gait_segmentation.inputs.folder import FolderSource, is_picture
from gait_segmentation.inputs.source import DamagedError, ImageSource, InputFrame, check_rate

__all__ = ['DamagedError', 'ImageSource', 'InputFrame', 'check_rate', 'open_input']


def open_input(
    path: str | os.PathLike[str],
    *,
    topic: str = '',
    width: int = 0,
    start: int = 0,
    count: int | None = None,
    rate: float = 0.0,
    rotate: int = 0,
    max_pixels: int = MOST_PIXELS,
    sample_bits: int = 16,
) -> ImageSource:
    """
    Open an input of whatever kind it is, and read its first frame.

    :param path: a film, a folder of images, a rosbag2 (folder, .mcap or .db3) or a ROS 1 bag.
    :param topic: of the images in a bag; it may be left out where there is only one, and must be
        for what is no bag.
    :param width: of the frames in pixels; 0, or more than the input has, leaves them as they are.
    :param start: first frame wanted, counted from 0.
    :param count: number of frames wanted, None for all that follow.
    :param rate: frames per second of a film or a folder; 0: what the film says, 30 in a folder.
        Bags have stamps and no rate. From 0.01 to 1000.
    :param rotate: degrees by which frames are turned clockwise, 0, 90, 180 or 270, before they are
        scaled; films of telephones, which say how they are to be turned, are without.
    :param max_pixels: how many a frame may have; one that claims more is not decoded.
    :param sample_bits: of images of 16 bits that the camera uses, 8 to 16.
    :raises SequenceError: if the input is missing, holds no images, or has no such frames.
    """
    path = Path(path)
    if re.match(r'[A-Za-z]+:/', str(path)) and not path.exists():
        raise SequenceError(
            f'{path} is an address and no file: fetch the film, or have a node publish the '
            'stream, such as ros2 run image_publisher image_publisher_node URL'
        )
    if path.is_char_device() or (
        not path.exists() and (path.name.isdigit() or str(path).startswith('/dev/video'))
    ):
        raise SequenceError(
            f'{path} is a camera and no recording: its driver publishes it, such as '
            'ros2 run v4l2_camera v4l2_camera_node'
        )
    wanted: dict[str, Any] = {
        'width': width, 'start': start, 'count': count, 'rate': rate, 'rotate': rotate,
        'max_pixels': max_pixels, 'sample_bits': sample_bits,
    }  # fmt: skip
    if path.exists() and is_bag(path):
        return BagSource(path, topic=topic, **wanted)
    if topic and path.exists():
        raise SequenceError(f'{path} is no bag and has no topic {topic}: leave out --topic')
    kind = FolderSource if path.is_dir() or is_picture(path) else FilmSource
    return kind(path, **wanted)
