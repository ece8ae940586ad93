# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes under test and a probe that feeds and records them, over real DDS."""

from __future__ import annotations

import gc
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import PolygonInstanceStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header

from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.ros.messages import image_message

TIMEOUT_S = 120.0
"""For what takes a moment, but may have to wait for kernels to be compiled on a busy computer."""

OUTPUTS = {
    'person_0/box': PolygonInstanceStamped,
    'person_0/likelihood': Image,
    'person_0/matched_box': PolygonInstanceStamped,
    'person_0/refined_box': PolygonInstanceStamped,
    'person_0/shape_prior': Image,
    'person_0/gait': JointState,
    'person_0/mask': Image,
    'mask': Image,
    'labels': Image,
}

STYLES = {'split': (TrackerNode, MatcherNode, SegmenterNode), 'single': (PipelineNode,)}
"""The nodes that make up a graph."""

CAMERAS = {'split': 2, 'single': 1}
"""How many of them see the images."""

DEEP = QoSProfile(depth=100)


def header(index: int, first_s: float = 100.0) -> Header:
    """Return the header of a frame at 30 Hz, with nanoseconds that no float holds."""
    stamp_ns = int(first_s * 1e9) + index * 33_333_337 + 1
    made = Header(frame_id='head_camera')
    made.stamp.sec, made.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    return made


def frame(index: int, size: tuple[int, int] = (160, 120), first_s: float = 100.0) -> Image:
    """Return an image of a red figure that crosses noise."""
    width, height = size
    image = np.random.default_rng(5).integers(60, 120, (height, width, 3)).astype(np.uint8)
    left = 30 + 2 * index
    image[20:100, left : left + 24] = (30, 30, 220)
    return image_message(image, header(index, first_s))


def finish(process: subprocess.Popen[str], code: int = 0) -> str:
    """Return what a process has said, having checked that it ended as it should."""
    output, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == code, output
    assert 'Traceback' not in output
    return output


class Bench:
    """Spins everything in the test's thread, so that a test says what it waits for."""

    def __init__(self, bank_file: Path) -> None:
        self.context = Context()
        rclpy.init(args=[], context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.probe = Node('probe', context=self.context)
        self.executor.add_node(self.probe)
        self.received: dict[str, list[Any]] = {}
        self.nodes: list[Any] = []
        self._bank_file = bank_file

    def close(self) -> None:
        while self.nodes:
            self.nodes[-1].close()
            self.nodes.pop().destroy_node()
        self.executor.shutdown()
        self.probe.destroy_node()
        rclpy.try_shutdown(context=self.context)
        # What is not collected stays a participant, and the next test's graph has its nodes.
        gc.collect()

    def add(self, kind: Any, start: bool = True, **parameters: Any) -> Any:
        """Add a node under test and start it."""
        if kind.__name__ in ('TrackerNode', 'MatcherNode', 'PipelineNode'):
            parameters.setdefault('bank', str(self._bank_file))
        if kind.__name__ in ('TrackerNode', 'PipelineNode'):
            # What comes of a thread of its own is not the same every time.
            parameters.setdefault('detector.network', 'none')
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        node = kind(context=self.context, parameter_overrides=overrides)
        self.nodes.append(node)
        self.executor.add_node(node)
        if start:
            assert node.start()
        return node

    def record(self, kind: Any, topic: str, profile: QoSProfile = DEEP) -> list[Any]:
        """Record a topic, to which whoever publishes it is connected."""
        kept = self.received.setdefault(topic, [])
        self.probe.create_subscription(kind, topic, kept.append, profile)
        self.until(lambda: self.probe.count_publishers(topic) > 0, f'publisher of {topic}')
        for made in (each for node in self.nodes for each in node.publishers):
            if made.topic_name.lstrip('/') == topic.lstrip('/'):
                self.until(
                    lambda p=made: p.get_subscription_count() >= self.readers(p),
                    f'readers of {topic}',
                )
        return kept

    def record_outputs(self, *topics: str) -> None:
        """Record some outputs, all if none is named."""
        for topic in topics or OUTPUTS:
            self.record(OUTPUTS[topic], topic)

    def readers(self, publisher: Any) -> int:
        """Return the number of readers that a publisher is to have."""
        return len(self.probe.get_subscriptions_info_by_topic(publisher.topic_name))

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service and return the answer."""
        client = self.probe.create_client(kind, name)
        self.until(client.service_is_ready, name)
        asked = client.call_async(request)
        self.until(asked.done, f'the answer of {name}')
        return asked.result()

    def publisher(self, kind: Any, topic: str, readers: int, profile: QoSProfile = DEEP) -> Any:
        """Return a publisher that is connected to a number of readers."""
        made = self.probe.create_publisher(kind, topic, profile)
        self.until(lambda: made.get_subscription_count() >= readers, f'{readers} on {topic}')
        return made

    def until(self, ready: Callable[[], bool], what: str) -> None:
        """Spin until something is true."""
        deadline = time.monotonic() + TIMEOUT_S
        while not ready():
            assert time.monotonic() < deadline, f'waited in vain for {what}'
            self.executor.spin_once(timeout_sec=0.01)

    def settle(self) -> None:
        """Spin until no callback is ready and all workers have done what they were given."""
        deadline = time.monotonic() + TIMEOUT_S
        quiet = 0
        while quiet < 2:
            assert time.monotonic() < deadline, 'it never became quiet'
            for node in self.nodes:
                assert node.drain(TIMEOUT_S)
            # What workers publish is ready at once: within a process it takes no time.
            quiet = 0 if self._call_one() else quiet + 1

    def _call_one(self) -> bool:
        """Call a callback that is ready, and return whether there was one."""
        try:
            handler, _, _ = self.executor.wait_for_ready_callbacks(timeout_sec=0.02)
        except TimeoutException:
            return False
        handler()
        handler.result()  # Raises what it raised.
        return True

    def feed(self, publisher: Any, messages: list[Any]) -> None:
        """Publish messages one by one, each when the outputs of the one before have come."""
        wanted = {topic: len(kept) for topic, kept in self.received.items() if topic in OUTPUTS}
        for message in messages:
            publisher.publish(message)
            for topic in wanted:
                wanted[topic] += 1
            self.until(
                lambda: all(len(self.received[t]) >= count for t, count in wanted.items()),
                f'outputs of {message.header.stamp}: '
                + ', '.join(f'{t} {len(self.received[t])}/{n}' for t, n in wanted.items()),
            )
