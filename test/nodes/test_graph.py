# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The three nodes together and gait_pipeline: the same promises hold for both."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import Image, RegionOfInterest
from std_srvs.srv import Trigger

from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.encodings import read_mono8
from gait_segmentation.geometry import Box
from gait_segmentation.nodes.camera_node import CameraNode
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.ros.messages import image_message
from gait_segmentation.streams.fields import GAIT_NAMES, TEMPLATE_NAMES, read_box, stamp_of
from test.nodes.bench import CAMERAS, OUTPUTS, STYLES, Bench, frame, header
from test.state import differences, remembered
from test.walkers import clip, couple, overlap, small_bank

PERSON = RegionOfInterest(x_offset=30, y_offset=20, width=24, height=80)


class Graph:
    """Nodes of one style that are connected with the probe, which records all outputs."""

    def __init__(self, bench: Bench, style: str) -> None:
        self.bench = bench
        self.nodes = [bench.add(kind) for kind in STYLES[style]]
        bench.record_outputs()
        self.camera = bench.publisher(Image, 'image', CAMERAS[style])
        self.starter = bench.publisher(RegionOfInterest, 'init_roi', 1)

    @property
    def warnings(self) -> set[str]:
        return set().union(*(node.warnings.said_s for node in self.nodes))

    def feed(self, *messages: Image) -> dict[str, list[object]]:
        """Feed frames; return what has come for them, having checked that it is one for each."""
        before = {topic: len(kept) for topic, kept in self.bench.received.items()}
        self.bench.feed(self.camera, list(messages))
        self.bench.settle()
        new = {topic: kept[before[topic] :] for topic, kept in self.bench.received.items()}
        for topic in OUTPUTS:
            assert [m.header for m in new[topic]] == [m.header for m in messages], topic
        return new

    def start(self, region: RegionOfInterest = PERSON) -> None:
        self.starter.publish(region)
        assert self.starter.wait_for_all_acked()
        self.bench.settle()

    def track(self, first: int = 0, count: int = 4) -> dict[str, list[object]]:
        """Start a track and feed frames."""
        self.start()
        return self.feed(*(frame(first + index) for index in range(count)))


@pytest.fixture(params=STYLES)
def graph(request: pytest.FixtureRequest, bench: Bench) -> Iterator[Graph]:
    return Graph(bench, request.param)


def masks(new: dict[str, list[object]]) -> list[np.ndarray]:
    return [read_mono8(message) for message in new['mask']]


def test_one_output_for_each_input_with_its_header(graph: Graph) -> None:
    nobody = graph.feed(frame(0), frame(1))
    assert not any(mask.any() for mask in masks(nobody))
    for topic in ('person_0/box', 'person_0/matched_box', 'person_0/refined_box'):
        assert all(not m.polygon.polygon.points for m in nobody[topic])
    assert all(not m.name for m in nobody['person_0/gait'])

    tracked = graph.track(2, 6)
    for message, box in zip(tracked['mask'], tracked['person_0/box'], strict=True):
        assert (message.encoding, message.height, message.width) == ('mono8', 120, 160)
        assert len(box.polygon.polygon.points) == 4
        assert box.polygon.id == 1
    for message, mask in zip(tracked['person_0/refined_box'], masks(tracked), strict=True):
        assert read_box(message)[0].iou(Box.around(mask)) > 0.6
    for mask, labels, own in zip(
        tracked['mask'], tracked['labels'], tracked['person_0/mask'], strict=True
    ):
        assert set(np.unique(read_mono8(mask))) == {0, 255}
        np.testing.assert_array_equal(read_mono8(labels) * 255, read_mono8(mask))
        assert mask == own
    sizes = {(m.height, m.width) for m in tracked['person_0/likelihood']}
    assert sizes == {(m.height, m.width) for m in tracked['person_0/shape_prior']}
    assert all(tuple(m.name) == GAIT_NAMES + TEMPLATE_NAMES for m in tracked['person_0/gait'])


def test_frames_that_cannot_be_read_give_empty_outputs_and_no_more(graph: Graph) -> None:
    graph.track(0, 4)
    odd, short = frame(4), frame(5)
    odd.encoding = '32FC4'
    short.data = short.data[:100]
    for message in (odd, short, Image(header=header(7), encoding='bgr8')):
        new = graph.feed(message)
        assert not masks(new)[0].any()
        assert not new['person_0/box'][0].polygon.polygon.points
    assert 'frame' in graph.warnings
    assert masks(graph.feed(frame(8)))[0].any()


def test_another_image_size_resets_and_the_stream_goes_on(graph: Graph) -> None:
    graph.track(0, 3)
    new = graph.feed(frame(3, (200, 140)), frame(4, (200, 140)))
    assert [mask.shape for mask in masks(new)] == [(140, 200)] * 2
    assert not any(mask.any() for mask in masks(new))
    # Every node that sees the images has heard of it.
    assert [n.name for n in graph.nodes if 'size' not in n.warnings.said_s] in (
        [],
        ['gait_matcher'],
    )
    assert masks(graph.track(5, 2))[0].any()


def test_stale_frames_are_dropped_and_counted_and_the_track_goes_on(graph: Graph) -> None:
    graph.track(0, 4)
    for index in (2, 3, 1):
        graph.camera.publish(frame(index))
    assert graph.camera.wait_for_all_acked()
    graph.bench.settle()
    new = graph.feed(frame(4))
    assert masks(new)[0].any()
    assert new['person_0/box'][0].polygon.id == 1
    assert graph.nodes[0].statistics.stale == 3
    assert 'time' not in graph.warnings


def test_first_boxes_that_make_no_sense_are_ignored(graph: Graph) -> None:
    graph.start(RegionOfInterest(x_offset=500, y_offset=0, width=20, height=50))
    graph.start(RegionOfInterest(x_offset=5, y_offset=5))
    new = graph.feed(frame(0))
    assert not new['person_0/box'][0].polygon.polygon.points
    assert graph.warnings >= {'box', 'roi'}


@pytest.mark.parametrize('style', STYLES)
def test_every_slot_answers_every_frame(bench: Bench, style: str) -> None:
    """Two people in three slots: one message per frame on each topic of each slot."""
    for kind in STYLES[style]:
        bench.add(kind, max_people=3)
    slots = [f'person_{slot}' for slot in range(3)]
    topics = {n.replace('person_0', slot): kind for n, kind in OUTPUTS.items() for slot in slots}
    for topic, kind in topics.items():
        bench.record(kind, topic)
    camera = bench.publisher(Image, 'image', CAMERAS[style])
    starter = bench.publisher(RegionOfInterest, 'init_roi', 1)
    for box in couple()[0].boxes:
        left, top, width, height = map(int, (box.x, box.y, box.width, box.height))
        starter.publish(RegionOfInterest(x_offset=left, y_offset=top, width=width, height=height))
    assert starter.wait_for_all_acked()
    bench.settle()
    for index, shown in enumerate(couple()[:4]):
        camera.publish(image_message(shown.image, header(index)))
        bench.until(
            lambda count=index + 1: all(len(bench.received[t]) == count for t in topics),
            'all outputs',
        )
        bench.settle()
    for topic in topics:
        assert [m.header for m in bench.received[topic]] == [header(i) for i in range(4)], topic
    labels = read_mono8(bench.received['labels'][-1])
    assert set(np.unique(labels)) == {0, 1, 2}
    for slot, name in enumerate(slots):
        own = read_mono8(bench.received[f'{name}/mask'][-1])
        np.testing.assert_array_equal(own, (labels == slot + 1) * np.uint8(255))
    assert [bench.received[f'{slot}/box'][-1].polygon.id for slot in slots] == [1, 2, 0]


def told(message: Any) -> Any:
    """Return what a message says but for its stamp and the id of the track."""
    if isinstance(message, PolygonInstanceStamped):
        return [(point.x, point.y) for point in message.polygon.polygon.points]
    if isinstance(message, Image):
        return message.data.tobytes(), message.height, message.width, message.encoding
    return message.name, message.position, message.velocity, message.effort


@pytest.mark.parametrize('style', STYLES)
def test_nodes_find_what_the_stages_find_again_in_a_bag_that_loops_and_keep_nothing(
    bench: Bench, style: str
) -> None:
    frames = clip()[:8]
    box = frames[0].boxes[0]
    start = {'initial_box': [box.x, box.y, box.width, box.height]}
    nodes = [
        bench.add(kind, **(start if issubclass(kind, CameraNode) else {}))
        for kind in STYLES[style]
    ]
    bench.record_outputs()
    camera = bench.publisher(Image, 'image', CAMERAS[style])
    # What is known of the stream and not of who is in it.
    kept = ['statistics', 'warnings', 'join', '_lessons', 'armed', '_pool']
    kept += ['_worker', '_pace', 'shape', '_shape', '_likelihood', '_size']
    before = [remembered(node, *kept) for node in nodes]
    for _ in range(2):
        for index, each in enumerate(frames):
            bench.feed(camera, [image_message(each.image, header(5 * index))])
            # Until the tracker has learnt from the mask, as in lockstep.
            bench.settle()
    for topic, messages in bench.received.items():
        first, again = messages[: len(frames)], messages[len(frames) :]
        assert [told(each) for each in first] == [told(each) for each in again], topic
    # The nodes have no detector here.
    config = PipelineConfig(detector=DetectorConfig(network='none'))
    pipeline = Pipeline(config, small_bank())
    pipeline.initialize(box)
    for index, (each, message) in enumerate(zip(frames, bench.received['mask'], strict=False)):
        (result,) = pipeline.update(each.image, stamp_of(header(5 * index)))
        mask, expected = read_mono8(message), result.mask
        assert expected.any()
        if style == 'single':
            np.testing.assert_array_equal(mask, expected)
        else:
            # Boxes cross as 32-bit floats.
            assert overlap(mask, expected) > 0.97
    for node in nodes:
        bench.call(Trigger, f'{node.name}/reset', Trigger.Request())
    bench.settle()
    for node, fresh in zip(nodes, before, strict=True):
        assert differences(fresh, remembered(node, *kept)) == []
