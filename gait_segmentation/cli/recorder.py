# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A node that records all outputs of the three nodes and knows when they are connected."""

from __future__ import annotations

import struct
import threading
import time
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonInstanceStamped
from numpy.typing import NDArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image, JointState

from gait_segmentation.geometry import Box
from gait_segmentation.ros.image import read_mono8
from gait_segmentation.ros.messages import read_box, read_gait, stamp_of

__all__ = ['Record', 'Recorder']

_DEPTH = 200

_TOPICS = {
    'person_0/box': PolygonInstanceStamped,
    'person_0/likelihood': Image,
    'person_0/matched_box': PolygonInstanceStamped,
    'person_0/shape_prior': Image,
    'person_0/gait': JointState,
    'person_0/mask': Image,
    'mask': Image,
    'labels': Image,
}

_UNREAD = ('person_0/likelihood', 'person_0/shape_prior', 'person_0/mask', 'labels')

_CDR_STAMP = struct.Struct('=4xiI')
"""Of a serialised message that begins with a header, in the byte order that DDS uses here."""

_CONNECTED = {
    'image_size': 1,
    'person_0/box': 2,
    'person_0/likelihood': 3,
    'person_0/matched_box': 3,
    'person_0/shape_prior': 3,
    'person_0/gait': 2,
    'person_0/mask': 2,
    'mask': 1,
    'labels': 1,
}
"""Subscribers of each topic when all nodes and the recorder are connected."""


@dataclass
class Record:
    """
    What was received for one frame.

    ``latency_s`` is the time from the frame's stamp to the arrival of its mask.
    """

    topics: dict[str, int] = field(default_factory=dict)
    packed: NDArray[np.uint8] | None = None
    shape: tuple[int, int] = (0, 0)
    box: Box | None = None
    track_id: int = 0
    phase: float = float('nan')
    azimuth: float = float('nan')
    arrived_s: float = 0.0
    latency_s: float = float('nan')

    @property
    def mask(self) -> NDArray[np.uint8]:
        """Return the mask, (H, W) uint8 0/255."""
        assert self.packed is not None
        bits = np.unpackbits(self.packed, count=self.shape[0] * self.shape[1])
        return np.asarray(bits.reshape(self.shape) * np.uint8(255))


class Recorder:
    """Records by stamp, in a thread of its own."""

    def __init__(self) -> None:
        """Subscribe and begin to record; rclpy must be initialised."""
        self.records: dict[int, Record] = {}
        self._subscribers: dict[str, int] = {}
        self._active: set[str] = set()
        self._lock = threading.Lock()
        self._node = Node('gait_recorder')
        for topic, kind in _TOPICS.items():
            # Of most images only the stamp is looked at: to make messages of them would cost
            # the nodes processor time.
            raw = topic in _UNREAD
            self._node.create_subscription(
                kind,
                topic,
                partial(self._receive_raw if raw else self._receive, topic),
                QoSProfile(depth=_DEPTH),
                raw=raw,
            )
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 10)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name='recorder', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop recording."""
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()

    def connected(self, *nodes: str) -> bool:
        """Return whether these nodes are active and connected with each other and with this."""
        alone = len(nodes) == 1
        with self._lock:
            return set(nodes) <= self._active and all(
                self._subscribers.get(f'/{topic}', 0) >= (topic in _TOPICS if alone else count)
                for topic, count in _CONNECTED.items()
            )

    def received(self, topic: str) -> int:
        """Return the number of messages received on a topic."""
        with self._lock:
            return sum(record.topics.get(topic, 0) for record in self.records.values())

    def complete(self) -> int:
        """Return the number of frames of which all outputs have come."""
        with self._lock:
            return sum(len(record.topics) == len(_TOPICS) for record in self.records.values())

    @property
    def topics(self) -> tuple[str, ...]:
        """Return the topics recorded."""
        return tuple(_TOPICS)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return

    def _receive_raw(self, topic: str, data: bytes) -> None:
        seconds, nanoseconds = _CDR_STAMP.unpack_from(data)
        with self._lock:
            record = self.records.setdefault(seconds * 1_000_000_000 + nanoseconds, Record())
            record.topics[topic] = record.topics.get(topic, 0) + 1

    def _receive(self, topic: str, message: Any) -> None:
        now = time.time()
        stamp_ns = stamp_of(message.header)
        with self._lock:
            record = self.records.setdefault(stamp_ns, Record())
            record.topics[topic] = record.topics.get(topic, 0) + 1
            if topic == 'mask':
                mask = read_mono8(message)
                record.shape = (mask.shape[0], mask.shape[1])
                record.packed = np.packbits(mask > 127)
                record.arrived_s = now
                record.latency_s = now - stamp_ns / 1e9
            elif topic == 'person_0/box':
                record.box = read_box(message)[0]
                record.track_id = int(message.polygon.id)
            elif topic == 'person_0/gait' and message.name:
                record.phase, _, record.azimuth = read_gait(message)

    def _diagnose(self, message: DiagnosticArray) -> None:
        prefix = 'subscribers of '
        with self._lock:
            for status in message.status:
                for each in status.values:
                    if each.key.startswith(prefix):
                        self._subscribers[each.key.removeprefix(prefix)] = int(each.value)
                    elif each.key == 'state' and each.value == 'active':
                        self._active.add(status.name)
