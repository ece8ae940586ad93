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

import lz4.block
import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonInstanceStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from numpy.typing import NDArray
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image, JointState

from gait_segmentation.geometry import Box
from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.ros.executor import MessageExecutor
from gait_segmentation.ros.fields import slot_topic
from gait_segmentation.ros.messages import read_box, read_gait, stamp_of

__all__ = ['Record', 'Recorder', 'Seen']

_DEPTH = 200
_SERVICE_S = 2.0

_SLOT_TOPICS = {
    'box': (PolygonInstanceStamped, 2),
    'likelihood': (Image, 3),
    'matched_box': (PolygonInstanceStamped, 3),
    'refined_box': (PolygonInstanceStamped, 1),
    'shape_prior': (Image, 3),
    'gait': (JointState, 2),
    'mask': (Image, 2),
}
_FRAME_TOPICS = {'mask': (Image, 1), 'labels': (Image, 1)}
"""Types of topics, and their subscribers when all nodes and the recorder are connected."""

_SLOT_UNREAD = ('likelihood', 'shape_prior', 'mask')

_CDR_STAMP = struct.Struct('=4xiI')
"""Of a serialised message that begins with a header, in the byte order that DDS uses here."""


@dataclass
class Seen:
    """What was received for one slot of one frame."""

    box: Box | None = None
    track_id: int = 0
    phase: float = float('nan')
    azimuth: float = float('nan')


@dataclass
class Record:
    """
    What was received for one frame.

    ``latency_s`` is the time from the frame's stamp to the arrival of its labels.
    """

    topics: dict[str, int] = field(default_factory=dict)
    people: dict[int, Seen] = field(default_factory=dict)
    packed: tuple[bytes, tuple[int, int]] | None = None
    arrived_s: float = 0.0
    latency_s: float = float('nan')

    @property
    def labels(self) -> NDArray[np.uint8]:
        """Return the labels, (H, W) uint8: 0 or slot + 1."""
        assert self.packed is not None
        data, shape = self.packed
        return np.frombuffer(lz4.block.decompress(data), np.uint8).reshape(shape).copy()

    def keep(self, labels: NDArray[np.uint8]) -> None:
        """Keep the labels in little memory; to make a PNG would take 50 times as long."""
        packed = lz4.block.compress(np.ascontiguousarray(labels).data)
        self.packed = packed, (labels.shape[0], labels.shape[1])

    @property
    def mask(self) -> NDArray[np.uint8]:
        """Return the mask of everybody, (H, W) uint8 0/255."""
        return np.where(self.labels > 0, 255, 0).astype(np.uint8)

    def person(self, slot: int) -> Seen:
        """Return what is known of a slot."""
        return self.people.setdefault(slot, Seen())


class Recorder:
    """Records by stamp, in a thread of its own."""

    def __init__(self, slots: int = 1) -> None:
        """Subscribe and begin to record; rclpy must be initialised."""
        self.records: dict[int, Record] = {}
        self._complete = 0
        self._messages = 0
        self._lost: dict[str, int] = {}
        self._unread = {'mask'}
        self._slots: dict[str, tuple[int, str]] = {}
        topics = dict(_FRAME_TOPICS)
        for slot in range(slots):
            for name, about in _SLOT_TOPICS.items():
                topic = slot_topic(slot, name)
                topics[topic] = about
                self._slots[topic] = (slot, name)
                if name in _SLOT_UNREAD:
                    self._unread.add(topic)
        self._topics = {topic: kind for topic, (kind, _) in topics.items()}
        self._connected = {
            'image_size': 1,
            **{topic: count for topic, (_, count) in topics.items()},
        }
        self._subscribers: dict[str, int] = {}
        self._active: set[str] = set()
        self._lock = threading.Lock()
        self._node = Node('gait_recorder')
        for topic, kind in self._topics.items():
            # Of most images only the stamp is looked at: to make messages of them would cost
            # the nodes processor time.
            raw = topic in self._unread
            self._node.create_subscription(
                kind,
                topic,
                partial(self._receive_raw if raw else self._receive, topic),
                QoSProfile(depth=_DEPTH),
                raw=raw,
            )
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 10)
        self._executor = MessageExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name='recorder', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop recording."""
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()

    def deactivate(self, name: str) -> None:
        """Deactivate a node, so that it publishes what it holds back."""
        client = self._node.create_client(ChangeState, f'{name}/change_state')
        if client.wait_for_service(_SERVICE_S):
            transition = Transition(id=Transition.TRANSITION_DEACTIVATE)
            client.call_async(ChangeState.Request(transition=transition))

    def connected(self, *nodes: str) -> bool:
        """Return whether these nodes are active and connected with each other and with this."""
        with self._lock:
            return set(nodes) <= self._active and all(
                self._subscribers.get(f'/{topic}', 0) >= count
                for topic, count in self._connected.items()
            )

    def active(self) -> set[str]:
        """Return the names of the nodes that say that they are active."""
        with self._lock:
            return set(self._active)

    def received(self, topic: str) -> int:
        """Return the number of messages received on a topic."""
        with self._lock:
            return sum(record.topics.get(topic, 0) for record in self.records.values())

    def complete(self) -> int:
        """Return the number of frames of which all outputs have come."""
        with self._lock:
            return self._complete

    def messages(self) -> int:
        """Return the number of messages that have come, also of frames that are not complete."""
        with self._lock:
            return self._messages

    def dropped(self) -> dict[str, int]:
        """Return how many frames each node says it has dropped, of those that have."""
        with self._lock:
            return {name: count for name, count in self._lost.items() if count}

    @property
    def topics(self) -> tuple[str, ...]:
        """Return the topics recorded."""
        return tuple(self._topics)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return

    def _count(self, stamp_ns: int, topic: str) -> Record:
        """Count a message, with the lock held, and return what is known of its frame."""
        record = self.records.setdefault(stamp_ns, Record())
        self._messages += 1
        count = record.topics[topic] = record.topics.get(topic, 0) + 1
        self._complete += count == 1 and len(record.topics) == len(self._topics)
        return record

    def _receive_raw(self, topic: str, data: bytes) -> None:
        seconds, nanoseconds = _CDR_STAMP.unpack_from(data)
        with self._lock:
            self._count(seconds * 1_000_000_000 + nanoseconds, topic)

    def _receive(self, topic: str, message: Any) -> None:
        now = time.time()
        stamp_ns = stamp_of(message.header)
        with self._lock:
            record = self._count(stamp_ns, topic)
            if topic == 'labels':
                record.keep(read_mono8(message))
                record.arrived_s = now
                record.latency_s = now - stamp_ns / 1e9
                return
            slot, name = self._slots[topic]
            if name == 'box':
                record.person(slot).box = read_box(message)[0]
                record.person(slot).track_id = int(message.polygon.id)
            elif name == 'gait' and message.name:
                person = record.person(slot)
                gait = read_gait(message)
                person.phase, person.azimuth = gait.phase, gait.azimuth

    def _diagnose(self, message: DiagnosticArray) -> None:
        prefix = 'subscribers of '
        with self._lock:
            for status in message.status:
                for each in status.values:
                    if each.key.startswith(prefix):
                        self._subscribers[each.key.removeprefix(prefix)] = int(each.value)
                    elif each.key == 'state' and each.value == 'active':
                        self._active.add(status.name)
                    elif each.key == 'skipped':
                        self._lost[status.name] = int(each.value)
