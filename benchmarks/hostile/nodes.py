# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The four nodes as processes, and a client that feeds them and hears what they answer."""

from __future__ import annotations

import os
import re
import threading
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from hostile.kinds import GOOD, Call, Shot
from hostile.services import TYPES
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CompressedImage, Image, JointState, RegionOfInterest

from benchmarks.nodes import MODULES, STYLES, Listener, resident_mib, wait
from gait_segmentation.cli.processes import ProcessGroup
from gait_segmentation.geometry import Box
from gait_segmentation.ros.endpoints import LATCHED
from gait_segmentation.ros.messages import stamp_of
from gait_segmentation.ros.vision import detection_types

__all__ = ['Client', 'Graphs']

_TRACKED = ('person_0/box', 'person_0/likelihood')
_ANSWERS = [f'split/{topic}' for topic in _TRACKED] + [
    f'single/{topic}'
    for topic in (
        *_TRACKED,
        *('person_0/matched_box', 'person_0/shape_prior', 'person_0/gait', 'person_0/mask'),
        *('mask', 'labels'),
    )
]
"""The topics on which every good frame is to be answered once: of the tracker, the pipeline."""

_KINDS = {'box': PolygonInstanceStamped, 'matched_box': PolygonInstanceStamped, 'gait': JointState}
"""Types of the topics of a person that are no images."""

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
_COUNTED = ('received', 'processed', 'failed', 'skipped', 'incomplete')
_LOGGED = re.compile(rb'^\[(?:DEBUG|INFO|WARN|ERROR|FATAL)\] \[', re.MULTILINE)
_PATIENCE_S = 900.0


class Graphs:
    """The processes of the nodes, started again when they end; a namespace for each style."""

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
        self._runs: dict[str, list[str]] = {name: [] for name in MODULES}
        self._processes = ProcessGroup(os.environ, logs)
        values = f'[{start.x:.2f}, {start.y:.2f}, {start.width:.2f}, {start.height:.2f}]'
        self._starts = ('-p', f'initial_box:={values}')
        self._transport = ('-p', f'image_transport:={transport}')
        for name in MODULES:
            self._start(name)

    def close(self) -> None:
        """Stop all."""
        self._processes.stop()

    def revive(self) -> list[str]:
        """Start again what has ended; return the names."""
        ended = [name for name, runs in self._runs.items() if self._processes.ended(runs[-1])]
        for name in ended:
            self.exits[name] += 1
            self._start(name)
        return ended

    def last_lines(self, name: str) -> str:
        """Return the last that a node said before it ended."""
        return self._processes.last_lines(self._runs[name][-2])

    def begin(self) -> None:
        """Measure memory and count lines from here on."""
        self._base = self._memory()
        self.peak = dict(self._base)
        self._lines = self._count()

    def watch(self) -> dict[str, float]:
        """Look at the memory; return by how many MiB each node has grown to a new height."""
        now = self._memory()
        higher = {name: now[name] - self.peak[name] for name in now if now[name] > self.peak[name]}
        self.peak |= {name: now[name] for name in higher}
        return higher

    def growth(self) -> dict[str, tuple[float, float]]:
        """Return by how many MiB each node has grown, and at most meanwhile."""
        now = self._memory()
        return {
            name: (now[name] - self._base[name], self.peak[name] - self._base[name])
            for name in now
        }

    def lines(self) -> dict[str, tuple[int, int]]:
        """Return how many lines each node has logged, and how many libraries have printed."""
        return {
            name: (own - self._lines[name][0], others - self._lines[name][1])
            for name, (own, others) in self._count().items()
        }

    def _start(self, name: str) -> None:
        runs = self._runs[name]
        runs.append(f'{name}_{len(runs)}')
        space = 'split' if name in STYLES['split'] else 'single'
        arguments = ['--ros-args', '-r', f'__ns:=/{space}']
        if name != 'gait_matcher':
            arguments += self._transport
        if name in ('gait_tracker', 'gait_pipeline'):
            arguments += self._starts
        self._processes.start(runs[-1], MODULES[name], *arguments)

    def _memory(self) -> dict[str, float]:
        pids = {name: self._processes.pid(runs[-1]) for name, runs in self._runs.items()}
        return {name: resident_mib(pid) for name, pid in pids.items()}

    def _count(self) -> dict[str, tuple[int, int]]:
        found = {}
        for name, runs in self._runs.items():
            said = b''.join((self._logs / f'{run}.log').read_bytes() for run in runs)
            own = len(_LOGGED.findall(said))
            found[name] = (own, said.count(b'\n') - own)
        return found


class Client(Listener):
    """Publishes to both graphs and counts the answers to good frames."""

    def __init__(self, transport: str) -> None:
        """
        Make all endpoints; rclpy must be initialised.

        :param transport: raw or compressed.
        """
        self.camera_topic = 'image' if transport == 'raw' else 'image/compressed'
        self._answers: dict[int, Counter[str]] = {}
        topics = (*_ANSWERS, 'split/mask')
        super().__init__({topic: _KINDS.get(topic.split('/')[-1], Image) for topic in topics})
        self._publishers = self._connect()
        self._clients = {
            (name, service): self.node.create_client(kind, f'/{space}/{name}/{service}')
            for space, names in STYLES.items()
            for name in names
            for service, kind in TYPES.items()
        }

    def wait_until_connected(self, ended: Callable[[], object]) -> bool:
        """
        Wait until all nodes are active, hear this client and are heard.

        :param ended: called meanwhile; a true value ends the waiting.
        """
        with self.changed:
            self.status.clear()
        wait(lambda: bool(ended()) or self._connected(), _PATIENCE_S)
        return self._connected()

    def fire(self, shot: Shot) -> None:
        """Publish a message to each graph that has a reader of it."""
        for space in STYLES:
            publisher = self._publishers.get(f'{space}/{shot.topic}')
            if publisher is not None:
                publisher.publish(shot.message)

    def show(self, message: Any) -> int:
        """Publish a good frame and return its stamp."""
        stamp_ns = stamp_of(message.header)
        with self.changed:
            self._answers[stamp_ns] = Counter()
        self.fire(Shot(self.camera_topic, message))
        return stamp_ns

    def call(self, call: Call, timeout_s: float) -> bool:
        """Call a service; return whether an answer has come."""
        client = self._clients[call.node, call.service]
        if not client.service_is_ready():
            return False
        done = threading.Event()
        client.call_async(call.request).add_done_callback(lambda _: done.set())
        return done.wait(timeout_s)

    def missing(self, stamp_ns: int) -> list[str]:
        """Return the topics on which a good frame has not been answered."""
        with self.changed:
            return [topic for topic in _ANSWERS if not self._answers[stamp_ns][topic]]

    def wait_for(self, stamp_ns: int, ended: Callable[[], object], timeout_s: float) -> bool:
        """
        Wait until a good frame has been answered.

        :param ended: called meanwhile; a true value ends the waiting.
        """
        wait(lambda: not self.missing(stamp_ns) or bool(ended()), timeout_s, 0.002)
        return not self.missing(stamp_ns)

    def wait_for_masks(self, timeout_s: float) -> None:
        """Wait until the three nodes are done with the newest good frame, if they answer it."""
        with self.changed:
            newest = next(reversed(self._answers.values()))
            self.changed.wait_for(lambda: newest['split/mask'], timeout_s)

    def counts(self, name: str) -> str:
        """Return what a node has last said of its frames."""
        with self.changed:
            said = next((v for k, v in self.status.items() if k.endswith(name)), {})
        return ', '.join(f'{key} {said.get(key, "?")}' for key in _COUNTED)

    def account(self) -> tuple[Counter[str], Counter[str], int]:
        """Return how many good frames lack an answer, or have several, by topic, and all."""
        with self.changed:
            found = list(self._answers.values())
        lost = Counter(topic for each in found for topic in _ANSWERS if not each[topic])
        twice = Counter(topic for each in found for topic in _ANSWERS if each[topic] > 1)
        return lost, twice, len(found)

    def heard(self, topic: str, stamp_ns: int, frame_id: str) -> None:
        """Count the answers to good frames."""
        if frame_id == GOOD and stamp_ns in self._answers:
            self._answers[stamp_ns][topic] += 1

    def _connect(self) -> dict[str, Any]:
        """Return the publishers by topic."""
        other = {'image', 'image/compressed'} - {self.camera_topic}
        camera = {topic: kind for topic, (kind, _) in _TO_CAMERA.items() if topic not in other}
        types = detection_types()
        camera |= {'detections': types.Detection2DArray} if types is not None else {}
        wanted = {f'{space}/{topic}': kind for space in STYLES for topic, kind in camera.items()}
        wanted |= {f'split/{topic}': kind for topic, (kind, _) in _TO_SPLIT.items()}
        return {
            topic: self.node.create_publisher(
                kind, topic, LATCHED if topic == 'split/image_size' else _DEEP
            )
            for topic, kind in wanted.items()
        }

    def _connected(self) -> bool:
        readers = {f'split/{t}': n for t, (_, n) in (_TO_SPLIT | _TO_CAMERA).items()}
        nodes = [f'{space}/{name}' for space, names in STYLES.items() for name in names]
        return (
            self.active(*nodes)
            and all(self.subscribers(topic) for topic in _ANSWERS)
            and all(
                made.get_subscription_count() >= readers.get(topic, 1)
                for topic, made in self._publishers.items()
            )
        )
