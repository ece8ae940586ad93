# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The four nodes as processes, and a client that feeds them and hears what they answer."""

from __future__ import annotations

import os
import re
import struct
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonInstanceStamped
from hostile.kinds import GOOD, Call, Shot
from hostile.services import TYPES
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CompressedImage, Image, JointState, RegionOfInterest

from gait_segmentation.cli.processes import ProcessGroup
from gait_segmentation.geometry import Box
from gait_segmentation.ros.executor import MessageExecutor
from gait_segmentation.ros.messages import stamp_of
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.ros.vision import detection_types

__all__ = ['GRAPHS', 'Client', 'Graphs']

GRAPHS = {
    'split': ('gait_tracker', 'gait_matcher', 'gait_segmenter'),
    'single': ('gait_pipeline',),
}
"""The namespaces, and the nodes in each."""

_TRACKED = {'person_0/box': PolygonInstanceStamped, 'person_0/likelihood': Image}
_ANSWERS = {
    'split': _TRACKED,
    'single': _TRACKED
    | {
        'person_0/matched_box': PolygonInstanceStamped,
        'person_0/shape_prior': Image,
        'person_0/gait': JointState,
        'person_0/mask': Image,
        'mask': Image,
        'labels': Image,
    },
}
"""The topics on which every good frame is to be answered once: of the tracker, the pipeline."""

_TO_CAMERA = {
    'image': (Image, 2),
    'image/compressed': (CompressedImage, 2),
    'init_roi': (RegionOfInterest, 1),
}
_TO_SPLIT = {
    'image_size': (RegionOfInterest, 1),
    'person_0/box': (PolygonInstanceStamped, 1),
    'person_0/likelihood': (Image, 2),
    'person_0/matched_box': (PolygonInstanceStamped, 2),
    'person_0/shape_prior': (Image, 2),
    'person_0/gait': (JointState, 1),
    'person_0/mask': (Image, 1),
}
"""The topics that are written to: type, and readers in the graph of three nodes."""

_DEEP = QoSProfile(depth=200)
_HEADER = struct.Struct('=4xiII')
"""Of a serialised message that begins with a header: stamp and length of the frame_id."""

_COUNTED = ('received', 'processed', 'failed', 'skipped', 'incomplete')
_LOGGED = re.compile(rb'^\[(?:DEBUG|INFO|WARN|ERROR|FATAL)\] \[', re.MULTILINE)
_PATIENCE_S = 900.0
_POLL_S = 0.002


class Graphs:
    """The processes of the nodes, started again when they end."""

    def __init__(self, logs: Path, transport: str, start: Box) -> None:
        """
        Start all.

        :param transport: raw or compressed.
        :param start: box of somebody in the first frame.
        """
        self.exits: Counter[str] = Counter()
        self.peak: dict[str, float] = {}
        self._base: dict[str, float] = {}
        self._logs = logs
        self._runs: dict[str, list[str]] = {}
        self._processes = ProcessGroup(os.environ, logs)
        values = f'[{start.x:.2f}, {start.y:.2f}, {start.width:.2f}, {start.height:.2f}]'
        self._starts = ('-p', f'initial_box:={values}')
        self._transport = ('-p', f'image_transport:={transport}')
        for space, names in GRAPHS.items():
            for name in names:
                self._start(space, name)

    def close(self) -> None:
        """Stop all."""
        self._processes.stop()

    def revive(self) -> list[str]:
        """Start again what has ended; return the names."""
        ended = [name for name, runs in self._runs.items() if self._processes.ended(runs[-1])]
        for name in ended:
            self.exits[name] += 1
            self._start(next(space for space, names in GRAPHS.items() if name in names), name)
        return ended

    def last_lines(self, name: str) -> str:
        """Return the last that a node said before it ended."""
        return self._processes.last_lines(self._runs[name][-2])

    def begin(self) -> None:
        """Measure memory and count lines from here on."""
        self._base = self._memory()
        self.peak = dict(self._base)
        self._lines = self._count()

    def watch(self) -> None:
        """Look at the memory."""
        for name, now in self._memory().items():
            self.peak[name] = max(self.peak.get(name, now), now)

    def growth(self) -> dict[str, tuple[float, float]]:
        """Return by how many MiB each node has grown, and at most meanwhile."""
        now = self._memory()
        return {
            name: (now[name] - self._base[name], self.peak[name] - self._base[name])
            for name in now
            if name in self._base
        }

    def lines(self) -> dict[str, tuple[int, int]]:
        """Return how many lines each node has logged, and how many libraries have printed."""
        return {
            name: (own - self._lines[name][0], others - self._lines[name][1])
            for name, (own, others) in self._count().items()
        }

    def _start(self, space: str, name: str) -> None:
        runs = self._runs.setdefault(name, [])
        runs.append(f'{name}_{len(runs)}')
        arguments = ['--ros-args', '-r', f'__ns:=/{space}']
        if name != 'gait_matcher':
            arguments += self._transport
        if name in ('gait_tracker', 'gait_pipeline'):
            arguments += self._starts
        module = f'gait_segmentation.nodes.{name.removeprefix("gait_")}_node'
        self._processes.start(runs[-1], module, *arguments)

    def _memory(self) -> dict[str, float]:
        found = {}
        for name, runs in self._runs.items():
            try:
                status = Path(f'/proc/{self._processes.pid(runs[-1])}/statm').read_text()
            except FileNotFoundError:
                continue
            if status:
                found[name] = int(status.split()[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20
        return found

    def _count(self) -> dict[str, tuple[int, int]]:
        found = {}
        for name, runs in self._runs.items():
            said = b''.join((self._logs / f'{run}.log').read_bytes() for run in runs)
            own = len(_LOGGED.findall(said))
            found[name] = (own, said.count(b'\n') - own)
        return found


class Client:
    """Publishes to both graphs and counts the answers to good frames."""

    def __init__(self, transport: str) -> None:
        """
        Make all endpoints; rclpy must be initialised.

        :param transport: raw or compressed.
        """
        self.camera_topic = 'image' if transport == 'raw' else 'image/compressed'
        self.refused: Counter[str] = Counter()
        self._answers: dict[int, Counter[str]] = {}
        self._changed = threading.Condition()
        self._reported: dict[str, dict[str, str]] = {}
        self._node = Node('hostile_client')
        self._publishers = self._connect(transport)
        for space, topics in _ANSWERS.items():
            for topic, kind in topics.items():
                name = f'{space}/{topic}'
                heard = partial(self._receive, name)
                self._node.create_subscription(kind, name, heard, _DEEP, raw=True)
        heard = partial(self._receive, 'split/mask')
        self._node.create_subscription(Image, 'split/mask', heard, _DEEP, raw=True)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 50)
        self._clients = {
            (name, service): self._node.create_client(kind, f'/{space}/{name}/{service}')
            for space, names in GRAPHS.items()
            for name in names
            for service, kind in TYPES.items()
        }
        self._executor = MessageExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()

    def wait_until_connected(self, alive: Callable[[], object]) -> bool:
        """
        Wait until all nodes are active, hear this client and are heard.

        :param alive: called meanwhile; a true value ends the waiting.
        """
        with self._changed:
            self._reported.clear()
        deadline = time.monotonic() + _PATIENCE_S
        while not self._connected():
            if alive() or time.monotonic() > deadline:
                return False
            time.sleep(10 * _POLL_S)
        return True

    def fire(self, shot: Shot) -> None:
        """Publish a message to each graph that has a reader of it."""
        for space in GRAPHS:
            publisher = self._publishers.get(f'{space}/{shot.topic}')
            if publisher is not None:
                publisher.publish(shot.message)

    def show(self, message: Any) -> int:
        """Publish a good frame and return its stamp."""
        assert message.header.frame_id == GOOD
        stamp_ns = stamp_of(message.header)
        with self._changed:
            self._answers[stamp_ns] = Counter()
        self.fire(Shot(self.camera_topic, message))
        return stamp_ns

    def call(self, call: Call, timeout_s: float) -> bool:
        """Call a service; return whether an answer has come."""
        client = self._clients[call.node, call.service]
        if not client.service_is_ready():
            return False
        done = threading.Event()
        future = client.call_async(call.request)
        future.add_done_callback(lambda _: done.set())
        return done.wait(timeout_s)

    def missing(self, stamp_ns: int) -> list[str]:
        """Return the topics on which a good frame has not been answered."""
        with self._changed:
            found = self._answers[stamp_ns]
            return [topic for topic in _answered() if not found[topic]]

    def wait_for(self, stamp_ns: int, alive: Callable[[], object], timeout_s: float) -> bool:
        """
        Wait until a good frame has been answered.

        :param alive: called meanwhile; a true value ends the waiting.
        """
        deadline = time.monotonic() + timeout_s
        while self.missing(stamp_ns):
            with self._changed:
                self._changed.wait(0.2)
            if alive() or time.monotonic() > deadline:
                return not self.missing(stamp_ns)
        return True

    def counts(self, name: str) -> str:
        """Return what a node has last said of its frames."""
        with self._changed:
            said = next((v for k, v in self._reported.items() if k.endswith(name)), {})
        return ', '.join(f'{key} {said.get(key, "?")}' for key in _COUNTED)

    def wait_for_masks(self, timeout_s: float) -> None:
        """Wait until the three nodes are done with the newest good frame, if they answer it."""
        with self._changed:
            newest = next(reversed(self._answers.values()))
            self._changed.wait_for(lambda: newest['split/mask'], timeout_s)

    def account(self) -> tuple[Counter[str], Counter[str], int]:
        """Return how many good frames lack an answer, or have several, by topic, and all."""
        lost: Counter[str] = Counter()
        twice: Counter[str] = Counter()
        with self._changed:
            for found in self._answers.values():
                lost.update(topic for topic in _answered() if not found[topic])
                twice.update(topic for topic in _answered() if found[topic] > 1)
            return lost, twice, len(self._answers)

    def _connect(self, transport: str) -> dict[str, Any]:
        """Return the publishers by topic."""
        made = {}
        types = detection_types()
        to_camera = {topic: kind for topic, (kind, _) in _TO_CAMERA.items()}
        del to_camera['image' if transport == 'compressed' else 'image/compressed']
        if types is not None:
            to_camera['detections'] = types.Detection2DArray
        for topic, kind in to_camera.items():
            for space in GRAPHS:
                made[f'{space}/{topic}'] = self._node.create_publisher(
                    kind, f'{space}/{topic}', _DEEP
                )
        for topic, (kind, _) in _TO_SPLIT.items():
            profile = LATCHED if topic == 'image_size' else _DEEP
            made[f'split/{topic}'] = self._node.create_publisher(kind, f'split/{topic}', profile)
        return made

    def _connected(self) -> bool:
        with self._changed:
            active = {
                name for name, values in self._reported.items() if values.get('state') == 'active'
            }
            heard = {
                key: value for values in self._reported.values() for key, value in values.items()
            }
        if not active >= {f'{space}/{name}' for space in GRAPHS for name in GRAPHS[space]}:
            return False
        for topic in _answered():
            if int(heard.get(f'subscribers of /{topic}', '0')) < 1:
                return False
        readers = {f'split/{t}': n for t, (_, n) in (_TO_SPLIT | _TO_CAMERA).items()}
        readers |= {f'single/{t}': 1 for t in _TO_CAMERA}
        return all(
            made.get_subscription_count() >= readers.get(topic, 1)
            for topic, made in self._publishers.items()
        )

    def _receive(self, topic: str, data: bytes) -> None:
        seconds, nanoseconds, length = _HEADER.unpack_from(data)
        start = _HEADER.size
        if data[start : start + length].rstrip(b'\0') != GOOD.encode():
            return
        with self._changed:
            found = self._answers.get(seconds * 1_000_000_000 + nanoseconds)
            if found is not None:
                found[topic] += 1
                self._changed.notify_all()

    def _diagnose(self, message: DiagnosticArray) -> None:
        with self._changed:
            for status in message.status:
                self._reported[status.name] = {each.key: each.value for each in status.values}

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return


def _answered() -> Iterable[str]:
    return (f'{space}/{topic}' for space, topics in _ANSWERS.items() for topic in topics)
