# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes as processes, and who listens to them, as benchmarks and fuzzers have them."""

from __future__ import annotations

import os
import struct
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Image

from gait_segmentation.geometry import Box
from gait_tools.demo.processes import ProcessError, ProcessGroup
from gait_tools.demo.recording import NODES, prepare_environment

STYLES = {'split': NODES, 'single': ('gait_pipeline',)}
ALL_NODES = (*NODES, 'gait_pipeline')

LINKS = {'box': 1, 'likelihood': 2, 'matched_box': 2, 'shape_prior': 2, 'mask': 1}
"""Subscribers that the topics of a person have when the three nodes are connected."""

START_TIMEOUT_S, _POLL_S = 180.0, 0.02
_HEADER = struct.Struct('=4xiII')
"""
Of a serialised message that begins with a header, in the byte order that DDS uses here: stamp, and
length of the frame_id.
"""


class Answers:
    """
    Hears the mask, as a user would, and the diagnostics, in a thread of its own.

    ``status`` is what the nodes last said by name, guarded by ``changed``, which is notified of
    every message.
    """

    def __init__(self, topics: Mapping[str, Any] | None = None) -> None:
        """
        Begin to listen; rclpy must be initialised.

        :param topics: types by name, in place of the mask's.
        """
        self.arrived: dict[int, float] = {}
        """Times at which frames were first answered, by their stamps in ns."""

        self.changed = threading.Condition()
        self.status: dict[str, dict[str, str]] = {}
        self.node = Node('listener')
        for topic, kind in (topics or {'mask': Image}).items():
            receive = partial(self._receive, topic)
            # Raw, to cost little.
            self.node.create_subscription(kind, topic, receive, QoSProfile(depth=200), raw=True)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 50)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, name='listener', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()

    def connected(self, nodes: tuple[str, ...]) -> bool:
        """Tell whether the nodes are active and connected."""
        wanted = {f'person_0/{topic}': count for topic, count in LINKS.items()}
        wanted = {'mask': 1} | (wanted if len(nodes) > 1 else {})
        return set(nodes) <= self.active() and all(
            self.subscribers(topic) >= count for topic, count in wanted.items()
        )

    def active(self) -> set[str]:
        """Return the names of the nodes that say that they are active."""
        with self.changed:
            return {name for name, said in self.status.items() if said.get('state') == 'active'}

    def subscribers(self, topic: str) -> int:
        """Return how many have subscribed to a topic of the nodes, as they say."""
        key = f'subscribers of /{topic}'
        with self.changed:
            return max((int(said.get(key, '0')) for said in self.status.values()), default=0)

    def answered(self, topic: str, stamp_ns: int, frame_id: str, now_s: float) -> None:
        """Note an answer, with the lock held."""
        self.arrived.setdefault(stamp_ns, now_s)

    def _receive(self, topic: str, message: bytes) -> None:
        """Look at the header; what is cut off by whoever else publishes there is passed over."""
        now_s = time.time()
        with self.changed:
            if len(message) >= _HEADER.size:
                seconds, nanoseconds, length = _HEADER.unpack_from(message)
                name = message[_HEADER.size : _HEADER.size + length].rstrip(b'\0')
                stamp_ns = seconds * 1_000_000_000 + nanoseconds
                self.answered(topic, stamp_ns, name.decode('latin1'), now_s)
            self.changed.notify_all()

    def _diagnose(self, message: DiagnosticArray) -> None:
        with self.changed:
            for status in message.status:
                said = {each.key: each.value for each in status.values}
                self.status[status.name] = self.status.get(status.name, {}) | said

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()


def processor_seconds(pid: int) -> float:
    """Return the processor time a process has taken."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process, NaN if it has just ended."""
    try:
        pages = Path(f'/proc/{pid}/statm').read_text().split()
    except FileNotFoundError:
        pages = []
    return int(pages[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20 if pages else float('nan')


def wait(done: Callable[[], bool], timeout_s: float, poll_s: float = _POLL_S) -> bool:
    """Wait until something is so; return whether it is."""
    deadline = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > deadline:
            return False
        time.sleep(poll_s)
    return True


@contextmanager
def ros() -> Iterator[None]:
    """Have rclpy initialised, apart from other ROS systems."""
    prepare_environment(os.environ)
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


@contextmanager
def session() -> Iterator[tuple[ProcessGroup, Answers]]:
    """Have processes and a listener."""
    with (
        ros(),
        tempfile.TemporaryDirectory() as logs,
        ProcessGroup(os.environ, Path(logs)) as processes,
    ):
        listener = Answers()
        try:
            yield processes, listener
        finally:
            listener.close()


def start_node(processes: ProcessGroup, name: str, *words: str) -> None:
    """Start a node, such as ``gait_tracker``."""
    processes.start(name, name.removeprefix('gait_'), *words)


def start(
    processes: ProcessGroup,
    nodes: tuple[str, ...],
    listener: Answers,
    *parameters: str,
    box: Box | None = None,
    preset: Path | None = None,
) -> None:
    """
    Start nodes and wait until they are active and connected.

    :param parameters: of all nodes, as ``name:=value``.
    :param box: of a person in the first frame; without, people are found.
    :param preset: the parameter file of all nodes, if any.
    """
    for name in nodes:
        given = list(parameters)
        if box is not None and name in ('gait_tracker', 'gait_pipeline'):
            numbers = f'{box.x:.2f}, {box.y:.2f}, {box.width:.2f}, {box.height:.2f}'
            given.append(f'initial_box:=[{numbers}]')
        words = [word for each in given for word in ('-p', each)]
        if preset is not None:
            words = ['--params-file', str(preset), *words]
        start_node(processes, name, '--ros-args', *words)

    def connected() -> bool:
        processes.check_running(*nodes)
        return listener.connected(nodes)

    if not wait(connected, START_TIMEOUT_S):
        raise ProcessError('the nodes did not connect')
