# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who listens to the nodes: what they publish, and what they say in the diagnostics."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Collection, Mapping
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
from gait_segmentation.ros.fields import slot_topic, slot_topics
from gait_segmentation.ros.messages import read_box, read_gait, stamp_of

__all__ = ['Listener', 'Record', 'Recorder', 'Seen']

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

_UNREAD = ('likelihood', 'shape_prior', 'mask')
"""Topics of images of which only the stamp is looked at."""

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

    ``latency_s`` is the time from the frame's stamp to the arrival of its labels.  ``number`` is
    that of the frame in the film, and ``time_s`` its time from the first one, once they are known.
    """

    topics: dict[str, int] = field(default_factory=dict)
    people: dict[int, Seen] = field(default_factory=dict)
    packed: tuple[bytes, tuple[int, int]] | None = None
    arrived_s: float = 0.0
    latency_s: float = float('nan')
    number: int = -1
    time_s: float = 0.0

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


class Listener:
    """
    Hears topics and the diagnostics, in a thread of its own.

    ``status`` is what the nodes last said by name, guarded by ``changed``, which is notified of
    every message.
    """

    def __init__(self, topics: Mapping[str, Any], raw: Collection[str]) -> None:
        """
        Begin to listen; rclpy must be initialised.

        :param topics: types by name.
        :param raw: the topics that are heard as bytes: to make messages of images would cost the
            nodes processor time.
        """
        self.changed = threading.Condition()
        self.status: dict[str, dict[str, str]] = {}
        self.node = Node('listener')
        for topic, kind in topics.items():
            receive = partial(self._receive, topic)
            qos = QoSProfile(depth=_DEPTH)
            self.node.create_subscription(kind, topic, receive, qos, raw=topic in raw)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 50)
        self._executor = MessageExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, name='listener', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()

    def active(self) -> set[str]:
        """Return the names of the nodes that say that they are active."""
        with self.changed:
            return {name for name, said in self.status.items() if said.get('state') == 'active'}

    def subscribers(self, topic: str) -> int:
        """Return how many have subscribed to a topic of the nodes, as they say."""
        key = f'subscribers of /{topic}'
        with self.changed:
            return max((int(said.get(key, '0')) for said in self.status.values()), default=0)

    def heard(self, topic: str, message: Any, now_s: float) -> None:
        """Take in a message, with the lock held, which came at a time."""
        raise NotImplementedError

    def _receive(self, topic: str, message: Any) -> None:
        now_s = time.time()
        with self.changed:
            self.heard(topic, message, now_s)
            self.changed.notify_all()

    def _diagnose(self, message: DiagnosticArray) -> None:
        with self.changed:
            for status in message.status:
                said = {each.key: each.value for each in status.values}
                self.status[status.name] = self.status.get(status.name, {}) | said

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return


class Recorder(Listener):
    """Records all outputs of the three nodes by stamp."""

    def __init__(self, slots: int = 1) -> None:
        """Subscribe and begin to record; rclpy must be initialised."""
        self.records: dict[int, Record] = {}
        self._complete = 0
        self._messages = 0
        topics = {**_FRAME_TOPICS, **slot_topics(_SLOT_TOPICS, slots)}
        self.topics = tuple(topics)
        """The topics recorded."""

        self._slots = {
            slot_topic(k, name): (k, name) for k in range(slots) for name in _SLOT_TOPICS
        }
        self._connected = {'image_size': 1} | {name: count for name, (_, count) in topics.items()}
        raw = {name for name in topics if name.rpartition('/')[2] in _UNREAD}
        super().__init__({name: kind for name, (kind, _) in topics.items()}, raw)

    def deactivate(self, name: str) -> None:
        """Deactivate a node, so that it publishes what it holds back."""
        client = self.node.create_client(ChangeState, f'{name}/change_state')
        if client.wait_for_service(_SERVICE_S):
            transition = Transition(id=Transition.TRANSITION_DEACTIVATE)
            client.call_async(ChangeState.Request(transition=transition))

    def connected(self, *nodes: str) -> bool:
        """Return whether these nodes are active and connected with each other and with this."""
        return set(nodes) <= self.active() and all(
            self.subscribers(topic) >= count for topic, count in self._connected.items()
        )

    def received(self, topic: str) -> int:
        """Return the number of messages received on a topic."""
        with self.changed:
            return sum(record.topics.get(topic, 0) for record in self.records.values())

    def complete(self) -> int:
        """Return the number of frames of which all outputs have come."""
        with self.changed:
            return self._complete

    def messages(self) -> int:
        """Return the number of messages that have come, also of frames that are not complete."""
        with self.changed:
            return self._messages

    def dropped(self) -> dict[str, int]:
        """Return how many frames each node says it has dropped, of those that have."""
        with self.changed:
            skipped = {name: int(said.get('skipped', '0')) for name, said in self.status.items()}
        return {name: count for name, count in skipped.items() if count}

    def heard(self, topic: str, message: Any, now_s: float) -> None:
        """Count a message, and record what it says."""
        if isinstance(message, bytes):
            seconds, nanoseconds = _CDR_STAMP.unpack_from(message)
            stamp_ns = seconds * 1_000_000_000 + nanoseconds
        else:
            stamp_ns = stamp_of(message.header)
        record = self.records.setdefault(stamp_ns, Record())
        self._messages += 1
        count = record.topics[topic] = record.topics.get(topic, 0) + 1
        self._complete += count == 1 and len(record.topics) == len(self.topics)
        slot, name = self._slots.get(topic, (0, topic))
        if topic == 'labels':
            record.keep(read_mono8(message))
            record.arrived_s = now_s
            record.latency_s = now_s - stamp_ns / 1e9
        elif name == 'box':
            record.person(slot).box = read_box(message)[0]
            record.person(slot).track_id = int(message.polygon.id)
        elif name == 'gait' and message.name:
            person, gait = record.person(slot), read_gait(message)
            person.phase, person.azimuth = gait.phase, gait.azimuth
