# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes as child processes, and what they publish."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import struct
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.files import prepare
from gait_segmentation.streams.fields import slot_topics

NODES = ('gait_tracker', 'gait_matcher', 'gait_segmenter')

_GRACE_S = 5.0
_PR_SET_PDEATHSIG = 1
_prctl = ctypes.CDLL(None).prctl

_LINKS = {
    'box': 1, 'likelihood': 2, 'matched_box': 2, 'shape_prior': 2, 'gait': 1, 'mask': 1,
}  # fmt: skip
"""Subscribers that the topics of a slot have when the three nodes are connected."""

_STAMP = struct.Struct('=4xiI')
"""Of a serialised message that begins with a header, in the byte order that DDS uses here."""


@contextlib.contextmanager
def ros() -> Iterator[None]:
    """Have rclpy initialised, on this computer alone and apart from other ROS systems on it."""
    os.environ.setdefault('ROS_DOMAIN_ID', str(20 + os.getpid() % 80))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp')
    prepare(os.environ)
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


class ProcessError(GaitSegmentationError):
    """A process that should run has ended, or ended with an error."""


class ProcessGroup(contextlib.AbstractContextManager['ProcessGroup']):
    """
    Named processes whose output goes to log files; at the end all are stopped, whatever happened.

    Those that are still there 5 seconds after SIGINT get SIGKILL; all do if this process dies.
    """

    def __init__(self, logs: Path) -> None:
        """Begin without processes; ``NAME.log`` of each will be in a folder."""
        logs.mkdir(parents=True, exist_ok=True)
        self._logs = logs
        self._children: dict[str, subprocess.Popen[bytes]] = {}

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self, name: str, *arguments: str) -> None:
        """Start ``python -m arguments``."""
        with open(self._logs / f'{name}.log', 'wb') as output:
            self._children[name] = subprocess.Popen(
                [sys.executable, '-m', *arguments],
                env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
                preexec_fn=partial(_prctl, _PR_SET_PDEATHSIG, signal.SIGKILL),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def start_node(self, name: str, *arguments: str) -> None:
        """Start a node, such as ``gait_tracker``."""
        module = f'gait_segmentation.nodes.{name.removeprefix("gait_")}_node'
        self.start(name, module, *arguments)

    def check_running(self, *names: str) -> None:
        """Make sure that these processes still run, and that no other has failed."""
        for name, process in self._children.items():
            code = process.poll()
            if code or (code is not None and name in names):
                how = f'was killed by signal {-code}' if code < 0 else f'ended with code {code}'
                raise ProcessError(f'{name} {how}\n{self.last_lines(name)}')

    def ended(self, name: str) -> bool:
        """Return whether a process has ended."""
        return self._children[name].poll() is not None

    def pid(self, name: str) -> int:
        """Return the number of a process."""
        return self._children[name].pid

    def last_lines(self, name: str, count: int = 15) -> str:
        """Return the end of a process's output, indented."""
        text = (self._logs / f'{name}.log').read_text(encoding='utf-8', errors='replace')
        return '\n'.join(f'    {line}' for line in text.splitlines()[-count:])

    def stop(self, *names: str) -> None:
        """Stop processes, all if none is named, and wait until they are gone."""
        children = [self._children[name] for name in names or self._children]
        for process in children:
            process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + _GRACE_S
        for process in children:
            try:
                process.wait(max(deadline - time.monotonic(), 0.0))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


class Listener:
    """Hears the nodes in a thread; ``lock`` guards ``arrived_s`` (by stamp) and ``status``."""

    def __init__(self, topics: Mapping[str, Any]) -> None:
        """Begin to listen to topics of messages with headers; rclpy must be initialised."""
        self.lock = threading.Lock()
        self.arrived_s: dict[int, float] = {}
        self.status: dict[str, dict[str, str]] = {}
        self._topics = tuple(topics)
        self.node = Node('listener')
        qos = QoSProfile(depth=200)
        for topic, kind in topics.items():
            receive = partial(self._receive, topic)
            # Raw, since whatever is done here takes time from the nodes.
            self.node.create_subscription(kind, topic, receive, qos, raw=True)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, qos)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, name='listener', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()

    def connected(self, nodes: Collection[str], people: int = 1) -> bool:
        """Return whether nodes say that they are active and connected, with this listener too."""
        wanted = Counter(self._topics)
        if len(nodes) > 1:
            wanted.update(slot_topics(_LINKS, people))
        with self.lock:
            known = list(self.status.values())
            active = {name for name, said in self.status.items() if said.get('state') == 'active'}
        return active >= set(nodes) and all(
            any(int(said.get(f'subscribers of /{topic}', '0')) >= count for said in known)
            for topic, count in wanted.items()
        )

    def heard(self, topic: str, stamp_ns: int, message: bytes) -> None:
        """Note a message, with the lock held."""
        self.arrived_s.setdefault(stamp_ns, time.time())

    def _receive(self, topic: str, message: bytes) -> None:
        # What is cut off by whoever else publishes there is passed over.
        if len(message) >= _STAMP.size:
            seconds, nanoseconds = _STAMP.unpack_from(message)
            with self.lock:
                self.heard(topic, seconds * 1_000_000_000 + nanoseconds, message)

    def _diagnose(self, message: DiagnosticArray) -> None:
        with self.lock:
            for status in message.status:
                said = {each.key: each.value for each in status.values}
                self.status.setdefault(status.name, {}).update(said)

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()
