# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What may happen on the wire and must not end or block a node."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PolygonInstanceStamped
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, RegionOfInterest

from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.ros import lifecycle
from gait_segmentation.ros.diagnostics import missing_input
from gait_segmentation.ros.endpoints import LATCHED
from gait_segmentation.ros.messages import box_message, image_message
from test.nodes.bench import DEEP, Bench, frame, header
from test.walkers import box_of, clip

BOX = [30.0, 20.0, 24.0, 80.0]
LOOPS = 3
CYCLES = 50


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


def test_a_node_can_be_cycled_fifty_times(bench: Bench, monkeypatch) -> None:
    # What is compiled once stays compiled, and takes most of the time.
    monkeypatch.setattr(lifecycle, 'compile_kernels', lambda *packages: None)
    node = bench.add(PipelineNode, start=False, initial_box=BOX)
    for cycle in range(CYCLES):
        for trigger in ('configure', 'activate', 'deactivate', 'cleanup'):
            getattr(node, f'trigger_{trigger}')()
        assert (node.state, node.outputs, node.inputs) == ('unconfigured', [], [])
        assert (node._worker, node.stage) == (None, None)
        bench.executor.spin_once(timeout_sec=0)
        if cycle == 4:
            before = (threading.active_count(), open_files())
    assert threading.active_count() <= before[0]
    assert open_files() <= before[1] + 2
    bench.until(lambda: bench.probe.count_subscribers('image') == 0, 'the subscription to end')
    assert node.start()
    bench.record_outputs('mask')
    bench.feed(bench.publisher(Image, 'image', 1), [frame(0)])


def test_a_flood_of_tiny_images_is_thinned_out(bench: Bench) -> None:
    node = bench.add(PipelineNode, backlog=5)
    bench.record_outputs('mask')
    camera = bench.publisher(Image, 'image', 1)
    tiny = np.zeros((6, 8, 3), np.uint8)
    flood = 2000
    for index in range(flood):
        camera.publish(image_message(tiny, header(index)))
        if index % 20 == 0:
            bench.executor.spin_once(timeout_sec=0)
    bench.settle()
    about = node.statistics
    assert about.received > 0
    assert about.received == about.processed + about.skipped + about.failed
    assert len(bench.received['mask']) == about.processed + about.failed
    before = len(bench.received['mask'])
    camera.publish(frame(flood))
    bench.until(lambda: len(bench.received['mask']) > before, 'the answer to a frame')
    assert bench.received['mask'][-1].width == frame(flood).width


def test_of_a_flood_of_boxes_no_more_start_than_there_are_slots(bench: Bench) -> None:
    node = bench.add(TrackerNode, max_people=2)
    bench.record_outputs('person_0/box')
    others = bench.record(PolygonInstanceStamped, 'person_1/box')
    # Handed over in the process: to send them would only test the network.
    flood = [
        RegionOfInterest(x_offset=n % 99, y_offset=9, width=24, height=80) for n in range(20_000)
    ]
    # While the worker is busy.
    go = threading.Event()
    node.later(lambda: go.wait(60.0))
    for region in flood:
        node._start(region)
    go.set()
    bench.feed(bench.publisher(Image, 'image', 1), [frame(0)])
    bench.until(lambda: len(others) == 1, 'the other box')
    found = (bench.received['person_0/box'][0], others[0])
    assert [message.polygon.id for message in found] == [1, 2]
    assert node.status()['people'] == '2'


ABSURD = {
    'huge': ((30.0, 20.0), (54.0, 20.0), (54.0, 1e12), (30.0, 1e12)),
    'far away': ((3e30, 20.0), (3e30, 20.0), (3e30, 99.0), (3e30, 99.0)),
    'crossed': ((141.7, 12.3), (1e30, -27.4), (187.0, -1e30), (128.3, 1e30)),
    'thin': ((50.0, 0.25), (90.0, 0.25), (90.0, 0.55), (50.0, 0.55)),
}


@pytest.mark.parametrize('size', [None, (2**32 - 1, 120)], ids=['no size', 'huge size'])
def test_the_matcher_answers_boxes_that_make_no_sense(bench: Bench, size) -> None:
    node = bench.add(MatcherNode)
    bench.record_outputs('person_0/matched_box', 'person_0/shape_prior', 'person_0/gait')
    if size is not None:
        sizes = bench.publisher(RegionOfInterest, 'image_size', 1, LATCHED)
        sizes.publish(RegionOfInterest(width=size[0], height=size[1]))
        bench.until(lambda: node._size == size, 'the size')
    boxes = bench.publisher(PolygonInstanceStamped, 'person_0/box', 1)
    likelihoods = bench.publisher(Image, 'person_0/likelihood', 1)
    for index, corners in enumerate(ABSURD.values()):
        likelihoods.publish(image_message(np.full((120, 160), 40, np.uint8), header(index)))
        bench.feed(boxes, [box_message(corners, 1, header(index))])
    assert node.statistics.failed == len(ABSURD)
    assert all(not message.name for message in bench.received['person_0/gait'])


def test_a_bag_that_is_looped_begins_anew_each_time(bench: Bench) -> None:
    box = box_of(clip()[0])
    node = bench.add(PipelineNode, initial_box=[box.x, box.y, box.width, box.height])
    bench.record_outputs()
    camera = bench.publisher(Image, 'image', 1)
    # Longer than the second up to which a step back is a stale frame.
    frames = [image_message(each.image, header(9 * n)) for n, each in enumerate(clip()[:5])]
    for _ in range(LOOPS):
        bench.feed(camera, frames)
    assert node.statistics.failed == 0
    masks = [read_mono8(message) for message in bench.received['mask']]
    stamps = [message.header.stamp for message in bench.received['mask']]
    assert len(masks) == LOOPS * len(frames)
    assert stamps == [message.header.stamp for message in frames] * LOOPS
    assert all(mask.any() for mask in masks)
    for loop in range(1, LOOPS):
        for first, again in zip(masks, masks[loop * len(frames) :], strict=False):
            np.testing.assert_array_equal(first, again)
    ids = [message.polygon.id for message in bench.received['person_0/box']]
    assert ids == sorted(ids)
    assert len(set(ids)) == LOOPS


@pytest.mark.parametrize('kind', [TrackerNode, MatcherNode, SegmenterNode])
def test_a_node_that_is_started_again_joins_the_others(bench: Bench, kind: Any) -> None:
    nodes = {each: bench.add(each) for each in (TrackerNode, MatcherNode, SegmenterNode)}
    bench.record_outputs()
    camera = bench.publisher(Image, 'image', 2)
    bench.feed(camera, [frame(0), frame(1)])
    gone = nodes.pop(kind)
    bench.executor.remove_node(gone)
    bench.nodes.remove(gone)
    gone.close()
    gone.destroy_node()
    readers = 1 if kind is not MatcherNode else 2
    bench.until(lambda: camera.get_subscription_count() == readers, 'the node to be gone')
    # Nobody answers these to the end, and they must not block what comes later.
    for index in (2, 3):
        camera.publish(frame(index))
    bench.settle()
    bench.add(kind)
    bench.until(lambda: camera.get_subscription_count() == 2, 'the node to be back')
    connected(bench)
    bench.received['mask'].clear()
    camera.publish(frame(4))
    bench.until(lambda: bool(bench.received['mask']), 'the mask of a frame')
    stamps = [message.header.stamp for message in bench.received['mask']]
    assert stamps[-1] == header(4).stamp
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


@pytest.mark.parametrize('kind', [TrackerNode, SegmenterNode])
def test_it_is_said_where_there_are_images(bench: Bench, stranger: Node, kind: Any) -> None:
    node = bench.add(kind)
    assert missing_input(node).startswith('no images: nobody publishes /image; start the camera')
    stranger.create_publisher(Image, 'camera/image_raw', DEEP)
    bench.until(lambda: bench.probe.count_publishers('camera/image_raw') == 1, 'the camera')
    assert 'there are images on /camera/image_raw' in missing_input(node)
    stranger.create_publisher(Image, 'image', DEEP)
    bench.until(lambda: bench.probe.count_publishers('image') == 1, 'images')
    reason = 'nothing comes from it' if kind is TrackerNode else 'nobody publishes /person_0/like'
    assert reason in missing_input(node)


@pytest.mark.parametrize('second', ['reliable', 'best_effort'])
@pytest.mark.parametrize('first', ['reliable', 'best_effort'])
def test_a_camera_that_is_started_again_is_heard(
    bench: Bench, stranger: Node, first: str, second: str
) -> None:
    bench.add(TrackerNode)
    bench.record_outputs('person_0/box')
    shown = map(frame, count())
    for reliability in (first, second):
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
