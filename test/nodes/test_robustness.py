# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What may happen on the wire and must not end or block a node."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from itertools import count
from types import SimpleNamespace
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image

from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.ros import lifecycle
from test.nodes.bench import Bench, frame, header

BOX = [30.0, 20.0, 24.0, 80.0]
CYCLES = 20


@pytest.fixture
def stranger() -> Iterator[Node]:
    """Return a node of another participant: one may not use a topic with two types."""
    context = Context()
    rclpy.init(args=[], context=context)
    node = Node('stranger', context=context)
    yield node
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def open_files() -> int:
    return len(os.listdir('/proc/self/fd'))


def test_a_node_can_be_cycled(bench: Bench, monkeypatch) -> None:
    # What is compiled once stays compiled, and takes most of the time.
    monkeypatch.setattr(lifecycle, 'compile_kernels', lambda *packages: None)
    node = bench.add(PipelineNode, start=False, initial_box=BOX)
    for cycle in range(CYCLES):
        for trigger in ('configure', 'activate', 'deactivate', 'cleanup'):
            getattr(node, f'trigger_{trigger}')()
        assert (node.state, node.outputs, node.inputs) == ('unconfigured', [], [])
        assert node.stage is None
        bench.executor.spin_once(timeout_sec=0)
        if cycle == 4:
            before = (threading.active_count(), open_files())
    # A network that is being loaded is not waited for.
    bench.until(lambda: threading.active_count() <= before[0], 'threads to end')
    assert open_files() <= before[1] + 2
    bench.until(lambda: bench.probe.count_subscribers('image') == 0, 'the subscription to end')
    assert node.start()
    bench.record_outputs('mask')
    bench.feed(bench.publisher(Image, 'image', 1), [frame(0)])


def test_of_frames_that_wait_too_many_are_dropped_and_counted(bench: Bench) -> None:
    node = bench.add(PipelineNode, backlog=5)
    bench.record_outputs('mask')
    go = threading.Event()
    node.later(lambda: go.wait(60.0))
    for index in range(9):
        node.receive('image', frame(index))
    go.set()
    bench.settle()
    about = node.statistics
    assert (about.received, about.failed) == (9, 0)
    assert about.dropped == 9 - about.processed > 0
    assert len(bench.received['mask']) == about.processed
    assert bench.received['mask'][-1].header == header(8)
    # What is lost on the way is told with all that was lost before.
    before = about.dropped
    for change, total in ((2, 2), (3, 5)):
        node._lost(SimpleNamespace(total_count=total, total_count_change=change))
    assert about.dropped == before + 5
    # Who configures it again counts from there on.
    node.trigger_deactivate()
    node.trigger_cleanup()
    assert node.start()
    about = node.statistics
    assert (about.received, about.processed, about.dropped) == (0, 0, 0)


def test_a_node_that_is_started_again_joins_the_others(bench: Bench) -> None:
    kinds = (TrackerNode, MatcherNode, SegmenterNode)
    nodes = {each: bench.add(each) for each in kinds}
    bench.record_outputs()
    camera = bench.publisher(Image, 'image', 2)
    bench.feed(camera, [frame(0), frame(1)])
    shown = count(2)
    for kind in kinds:
        gone = nodes.pop(kind)
        bench.executor.remove_node(gone)
        bench.nodes.remove(gone)
        gone.close()
        gone.destroy_node()
        readers = 1 if kind is not MatcherNode else 2
        bench.until(lambda n=readers: camera.get_subscription_count() == n, 'the node to be gone')
        # Nobody answers this to the end, and it must not block what comes later.
        camera.publish(frame(next(shown)))
        bench.settle()
        nodes[kind] = bench.add(kind)
        bench.until(lambda: camera.get_subscription_count() == 2, 'the node to be back')
        connected(bench)
        bench.received['mask'].clear()
        number = next(shown)
        camera.publish(frame(number))
        bench.until(lambda: bool(bench.received['mask']), 'the mask of a frame')
        assert bench.received['mask'][-1].header == header(number)
        assert all(node.state == 'active' for node in bench.nodes)


def connected(bench: Bench) -> None:
    """Wait until everybody reads what the others publish."""
    readers = {
        'person_0/box': 1, 'person_0/likelihood': 2, 'person_0/matched_box': 2,
        'person_0/shape_prior': 2, 'person_0/gait': 1, 'person_0/mask': 1,
    }  # fmt: skip
    for node in bench.nodes:
        for publisher in node.outputs:
            least = readers.get(publisher.topic_name.lstrip('/'))
            if least is not None:
                # And the probe.
                bench.until(
                    lambda p=publisher, least=least: p.get_subscription_count() > least,
                    f'readers of {publisher.topic_name}',
                )


def test_a_camera_that_is_started_again_is_heard_however_reliable(
    bench: Bench, stranger: Node
) -> None:
    bench.add(TrackerNode)
    bench.record_outputs('person_0/box')
    shown = map(frame, count())
    for reliability in ('reliable', 'best_effort', 'reliable'):
        profile = QoSProfile(depth=10, reliability=ReliabilityPolicy[reliability.upper()])
        camera = stranger.create_publisher(Image, 'image', profile)
        bench.until(lambda c=camera: c.get_subscription_count() == 1, 'the subscription')
        before = len(bench.received['person_0/box'])

        def heard(camera: Any = camera, before: int = before) -> bool:
            # Best effort may lose the first ones.
            camera.publish(next(shown))
            return len(bench.received['person_0/box']) > before

        bench.until(heard, 'an answer')
        stranger.destroy_publisher(camera)
        bench.until(lambda: bench.probe.count_publishers('image') == 0, 'the camera to be gone')
        bench.settle()
