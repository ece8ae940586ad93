# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small bags of all kinds, written with rosbags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_typestore

IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED = 'sensor_msgs/msg/CompressedImage'
FIRST_NS = 1_700_000_000_123_456_789
STEP_NS = 33_333_337

ROS2 = get_typestore(Stores.ROS2_JAZZY)
ROS1 = get_typestore(Stores.ROS1_NOETIC)


def stamp(index: int) -> int:
    """Return the stamp of a header; the recording comes 5 ms later."""
    return FIRST_NS + index * STEP_NS


def image_fields(image: NDArray[np.uint8], stamp_ns: int, encoding: str = 'bgr8') -> Any:
    types = ROS2.types
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    time = types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
    header = types['std_msgs/msg/Header'](stamp=time, frame_id='head_camera')
    return types[IMAGE](
        header=header,
        height=image.shape[0],
        width=image.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=image.strides[0],
        data=image.reshape(-1),
    )


def compressed_fields(image: NDArray[np.uint8], stamp_ns: int, kind: str = 'png') -> Any:
    header = image_fields(image, stamp_ns).header
    data = np.asarray(cv2.imencode(f'.{kind}', image)[1]).reshape(-1)
    return ROS2.types[COMPRESSED](header=header, format=kind, data=data)


def write_bag2(
    path: Path,
    topics: dict[str, list[Any]],
    plugin: StoragePlugin = StoragePlugin.MCAP,
    mode: CompressionMode | None = None,
) -> Path:
    """Write messages by topic, in the order of their index."""
    writer = Writer2(path, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        _write(writer, topics, ROS2.serialize_cdr, ROS2)
    return path


def write_bag1(path: Path, topics: dict[str, list[Any]]) -> Path:
    def serialize(message: Any, kind: str) -> Any:
        old = ROS1.types
        header = message.header
        made = old['std_msgs/msg/Header'](
            seq=7,
            stamp=old['builtin_interfaces/msg/Time'](
                sec=header.stamp.sec, nanosec=header.stamp.nanosec
            ),
            frame_id=header.frame_id,
        )
        fields = {
            name: getattr(message, name)
            for name in message.__dataclass_fields__
            if name not in ('header', '__msgtype__')
        }
        return ROS1.serialize_ros1(old[kind](header=made, **fields), kind)

    with Writer1(path) as writer:
        _write(writer, topics, serialize, ROS1)
    return path


def _write(writer: Any, topics: dict[str, list[Any]], serialize: Any, store: Any) -> None:
    connections = {
        name: writer.add_connection(name, messages[0].__msgtype__, typestore=store)
        for name, messages in topics.items()
    }
    for index in range(max(map(len, topics.values()))):
        for name, messages in topics.items():
            if index < len(messages):
                message = messages[index]
                data = serialize(message, message.__msgtype__)
                writer.write(connections[name], stamp(index) + 5_000_000, bytes(data))


def grey(index: int, size: tuple[int, int] = (60, 40)) -> NDArray[np.uint8]:
    """Return an image that tells its number: 10 times it."""
    return np.full((size[1], size[0], 3), 10 * index, np.uint8)


def greys(count: int, size: tuple[int, int] = (60, 40)) -> list[Any]:
    return [image_fields(grey(index, size), stamp(index)) for index in range(count)]
