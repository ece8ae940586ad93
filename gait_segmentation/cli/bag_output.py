# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The messages of the live graph, written to a new bag without ROS."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags import interfaces
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from gait_segmentation.cli.outputs import Output
from gait_segmentation.inputs import Frame
from gait_segmentation.pipeline import FrameResult
from gait_segmentation.streams.fields import (
    DEPTH,
    Corners,
    gait_joints,
    matched_corners,
    refined_corners,
    slot_topic,
    slot_topics,
    track_corners,
)

_BOX = 'geometry_msgs/msg/PolygonInstanceStamped'
_IMAGE = 'sensor_msgs/msg/Image'
_GAIT = 'sensor_msgs/msg/JointState'
_SIZE = 'sensor_msgs/msg/RegionOfInterest'

_SLOT_TOPICS = {
    'box': _BOX,
    'likelihood': _IMAGE,
    'matched_box': _BOX,
    'refined_box': _BOX,
    'shape_prior': _IMAGE,
    'gait': _GAIT,
    'mask': _IMAGE,
}

_MARK = 'gait_replay'
"""Of the entry in the metadata that says who made a bag."""

_FOREVER = interfaces.QosTime(2147483647, 4294967295)


class BagOutput(Output):
    """
    A rosbag2 (MCAP) with the topics and messages of the live graph.

    Messages are recorded at the time at which the source image was, so that both bags can be
    played or shown together.
    """

    option = '--out'
    help = 'bags (MCAP), one each, with the topics and messages of the live nodes (%(default)s)'
    default = Path('out/replay')
    in_folder = True
    files = re.compile(r'metadata\.yaml|[^/]+\.mcap')

    def begin(self) -> None:
        """Open the bag and declare the topics."""
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._shape: tuple[int, ...] | None = None
        self._writer: Any = Writer(self.work, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._writer.set_custom_data(_MARK, 'complete')
        self._writer.open()
        # rosbags calls the file as the folder, which is going to be renamed.
        storage = self._writer.storage
        storage.path = storage.path.rename(self.work / f'{self.path.name}.mcap')
        self._connections: dict[str, Any] = {}
        self._connect('image_size', _SIZE, latched=True)
        for topic, kind in slot_topics(_SLOT_TOPICS, self.about.slots).items():
            self._connect(topic, kind)
        self._connect('mask', _IMAGE)
        self._connect('labels', _IMAGE)

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether the bag says so."""
        about = path / 'metadata.yaml'
        return about.is_file() and _MARK.encode() in about.read_bytes()

    def add(self, frame: Frame, result: FrameResult) -> None:
        """Write all messages of a frame."""
        # The header of the source image, bit for bit.
        time = self._made('builtin_interfaces/msg/Time', *divmod(frame.header_ns, 1_000_000_000))
        header = self._made('std_msgs/msg/Header', time, frame.frame_id)
        shape = result.mask.shape
        if shape != self._shape and frame.image is not None:
            self._shape = shape
            self._write('image_size', frame, 0, 0, *shape, False)
        for slot, person in enumerate(result.people):
            track, match = person.track, person.match
            names, *numbers = gait_joints(match)
            messages = {
                'box': self._polygon(track_corners(track), track.track_id),
                'likelihood': _image(track.likelihood),
                'matched_box': self._polygon(matched_corners(match), match.track_id),
                'refined_box': self._polygon(refined_corners(match), match.track_id),
                'shape_prior': _image(match.shape_prior),
                'gait': [list(names), *(np.array(each, np.float64) for each in numbers)],
                'mask': _image(person.segmentation.mask),
            }
            for name, fields in messages.items():
                self._write(slot_topic(slot, name), frame, header, *fields)
        self._write('mask', frame, header, *_image(result.mask))
        self._write('labels', frame, header, *_image(result.labels))

    def finish(self) -> None:
        """Write the index."""
        storage = self._writer.storage
        try:
            self._writer.close()
        except OSError:
            with suppress(OSError):
                storage.bio.close()
            raise

    def _connect(self, topic: str, kind: str, latched: bool = False) -> None:
        durability = interfaces.QosDurability
        qos = interfaces.Qos(
            history=interfaces.QosHistory.KEEP_LAST,
            depth=1 if latched else DEPTH,
            reliability=interfaces.QosReliability.RELIABLE,
            durability=durability.TRANSIENT_LOCAL if latched else durability.VOLATILE,
            deadline=_FOREVER,
            lifespan=_FOREVER,
            liveliness=interfaces.QosLiveliness.AUTOMATIC,
            liveliness_lease_duration=_FOREVER,
            avoid_ros_namespace_conventions=False,
        )
        self._connections[topic] = self._writer.add_connection(
            f'/{topic}', kind, typestore=self._store, offered_qos_profiles=[qos]
        )

    def _made(self, kind: str, *fields: Any) -> Any:
        return self._store.types[kind](*fields)

    def _polygon(self, corners: Corners, track_id: int) -> list[Any]:
        """Return the fields of a box but for its header."""
        points = [
            self._made('geometry_msgs/msg/Point32', float(x), float(y), 0.0) for x, y in corners
        ]
        polygon = self._made('geometry_msgs/msg/Polygon', points)
        return [self._made('geometry_msgs/msg/PolygonInstance', polygon, track_id)]

    def _write(self, topic: str, frame: Frame, *fields: Any) -> None:
        connection = self._connections[topic]
        message = self._made(connection.msgtype, *fields)
        data = self._store.serialize_cdr(message, connection.msgtype)
        self._writer.write(connection, frame.recorded_ns, data)


def _image(image: NDArray[np.uint8]) -> list[Any]:
    """Return the fields of a (H, W) uint8 image as mono8 but for its header."""
    height, width = image.shape
    return [height, width, 'mono8', 0, width, np.ascontiguousarray(image).reshape(-1)]
