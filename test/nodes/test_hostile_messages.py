# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages that are wrong in a field, in their pixels or alone: every good frame is answered."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import Point32, PolygonInstanceStamped
from hypothesis import given, strategies as st
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, RegionOfInterest
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from gait_segmentation.inputs.encodings import ENCODINGS, read_bgr
from gait_segmentation.nodes.localizer_node import LocalizerNode
from gait_segmentation.ros.endpoints import LATCHED
from gait_segmentation.ros.messages import compressed_message, detection_types, image_message
from gait_segmentation.streams.fields import GAIT_NAMES
from test.hostile import examples, spoilt_bytes
from test.nodes.bench import DEEP, STYLES, Bench, frame, header

BOX = [30.0, 20.0, 24.0, 80.0]
DETECTIONS = detection_types()
SETS = {
    'image': ('image',),
    'first box': ('init_roi',),
    'heat map': ('heat_map',),
    **({} if DETECTIONS is None else {'detections': ('detections',)}),
    'image size': ('image_size', 'person_0/box', 'person_0/likelihood'),
    'segmenter': ('person_0/likelihood', 'person_0/matched_box', 'person_0/shape_prior',
                  'person_0/gait', 'image'),
    'feedback': ('person_0/mask', 'person_0/shape_prior', 'person_0/matched_box'),
    'localizer': ('camera_info', 'depth', 'person_0/matched_box', 'person_0/gait',
                  'person_0/mask'),
}  # fmt: skip
"""Messages that a node takes together."""

FLOATS = (math.nan, math.inf, -math.inf, 0.0, -1.0, 1e-30, 60.0, 1e7, 3e38)
EXTREMES: dict[str, tuple[Any, ...]] = {
    'boolean': (True, False),
    'uint8': (0, 1, 77, 255),
    'int32': (0, -1, 500, -(2**31), 2**31 - 1),
    'uint32': (0, 1, 7, 320, 8192, 65_536, 2**31, 2**32 - 1),
    'float': FLOATS,
    'double': (*FLOATS, 1e300),
    'string': ('', 'BGR8', '16UC1', 'h264', '%s%n', 'a\nb', '🙂' * 50, 'a' * 10_000, *ENCODINGS),
}
PARAMETERS = ('backlog', 'max_people', 'tracking.working_height', 'matching.window', 'no_such')
VALUES = (-5, 2**40, math.nan, -math.inf, 'magic', [math.nan] * 4)
"""None of which any of them takes."""

SHAPES = ((1, 1), (1, 3000), (3000, 1), (3, 500), (120, 160), (480, 640))


def good(topic: str, about: Header) -> Any:
    """Return a message of somebody in the middle of a frame."""
    if topic == 'image':
        return image_message(np.full((120, 160, 3), 90, np.uint8), about)
    if topic == 'image/compressed':
        return compressed_message(np.full((120, 160, 3), 90, np.uint8), about)
    if topic in ('image_size', 'init_roi'):
        return RegionOfInterest(x_offset=30 * (topic == 'init_roi'), width=160, height=120)
    if topic == 'detections':
        bounds = DETECTIONS.BoundingBox2D(size_x=24.0, size_y=80.0)
        bounds.center.position.x, bounds.center.position.y = 42.0, 60.0
        guess = DETECTIONS.ObjectHypothesis(class_id='person', score=0.9)
        results = [DETECTIONS.ObjectHypothesisWithPose(hypothesis=guess)]
        found = [DETECTIONS.Detection2D(results=results, bbox=bounds)]
        return DETECTIONS.Detection2DArray(header=about, detections=found)
    if topic == 'person_0/gait':
        fields = {'position': [1.0, 0.0], 'velocity': [6.0, 0.0], 'effort': [0.9, 0.7]}
        return JointState(header=about, name=list(GAIT_NAMES), **fields)
    if topic == 'camera_info':
        k = [200.0, 0.0, 80.0, 0.0, 200.0, 60.0, 0.0, 0.0, 1.0]
        return CameraInfo(header=about, width=160, height=120, k=k)
    if topic == 'depth':
        made = Image(header=about, encoding='32FC1', step=640, width=160, height=120)
        made.data.frombytes(np.full((120, 160), 4.0, '<f4').tobytes())
        return made
    if topic.endswith('box'):
        return polygon(((30.0, 20.0), (54.0, 20.0), (54.0, 100.0), (30.0, 100.0)), about)
    return image_message(
        cv2.rectangle(np.zeros((120, 160), np.uint8), (30, 20), (54, 99), 255, -1), about
    )


def polygon(corners: Any, about: Header) -> PolygonInstanceStamped:
    made = PolygonInstanceStamped(header=about)
    made.polygon.id = 1
    made.polygon.polygon.points = [Point32(x=x, y=y) for x, y in corners]
    return made


def leaves(message: Any) -> Iterator[tuple[Any, str]]:
    """Go through the fields of a message, and of those inside, with what they are fields of."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        for inside in value[:4] if isinstance(value, list) else [value]:
            if hasattr(inside, 'get_fields_and_field_types'):
                yield from leaves(inside)
        if not hasattr(value, 'get_fields_and_field_types'):
            yield message, name


@st.composite
def spoilt(draw: Any, topic: str, about: Header) -> Any:
    """Draw a message with an odd value in a field, or odd pixels or corners."""
    message = good(topic, about)
    if draw(st.booleans()):
        if isinstance(message, CompressedImage):
            noise = np.random.default_rng(0).integers(0, 256, (*draw(st.sampled_from(SHAPES)), 3))
            kind = draw(st.sampled_from(['.jpg', '.png', '.webp', '.bmp', '.tiff', '.ppm']))
            data = cv2.imencode(kind, noise.astype(np.uint8))[1].tobytes()
            message.data = array('B', draw(spoilt_bytes(data)))
            return message
        if isinstance(message, Image):
            shape = (*draw(st.sampled_from(SHAPES)), *draw(st.sampled_from([(), (3,)])))
            flat = np.full(shape, draw(st.sampled_from((0, 1, 127, 255))), np.uint8)
            noise = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
            return image_message(draw(st.sampled_from((flat, noise))), about)
        if isinstance(message, PolygonInstanceStamped):
            value = st.sampled_from((*FLOATS, -900.0, 180.0))
            return polygon([(draw(value), draw(value)) for _ in range(4)], about)
    inside, name = draw(st.sampled_from(list(leaves(message))))
    value = getattr(inside, name)
    if isinstance(value, np.ndarray):
        value[draw(st.integers(0, len(value) - 1))] = draw(st.sampled_from(EXTREMES['double']))
    elif isinstance(value, list | array):
        ways = [value[:0], value[:-1], value[:1] * 2, value * (2 if len(value) > 99 else 5000)]
        if isinstance(value, array) and value.typecode == 'd':
            ways += [array('d', [each] * len(value)) for each in FLOATS]
        setattr(inside, name, draw(st.sampled_from(ways)))
    else:
        kind = inside.get_fields_and_field_types()[name]
        setattr(inside, name, draw(st.sampled_from(EXTREMES[kind])))
    return message


class Graph:
    """Nodes that are shown good frames, with spoilt messages between."""

    def __init__(self, bench: Bench, style: str) -> None:
        self.bench, self.number = bench, 0
        self.packed = style == 'compressed'
        nodes = (*STYLES['split'], LocalizerNode) if style == 'split' else STYLES['single']
        for kind in nodes:
            camera = {'image_transport': 'compressed'} if self.packed else {}
            box = {'initial_box': BOX} if kind.name in ('gait_tracker', 'gait_pipeline') else {}
            bench.add(kind, **camera, **box)
        self.answers = ('person_0/box', 'person_0/likelihood')
        if style != 'split':
            self.answers = (*self.answers, 'person_0/gait', 'mask', 'labels')
        bench.record_outputs(*self.answers)
        read = {s.topic_name for node in bench.nodes for s in node.subscriptions}
        sets = {'image/compressed': ('image/compressed',)} if self.packed else SETS
        self.sets = [each for each in sets.values() if read >= {f'/{topic}' for topic in each}]
        self.publishers = {
            topic: bench.publisher(
                type(good(topic, Header())), topic, 1, LATCHED if topic == 'image_size' else DEEP
            )
            for topic in {topic for each in self.sets for topic in each}
        }

    def show(self) -> None:
        """Show a good frame: it is answered once."""
        self.number += 1
        image = frame(self.number % 20)
        image.header = header(self.number)
        if self.packed:
            image = compressed_message(read_bgr(image), image.header)
        self.publishers['image/compressed' if self.packed else 'image'].publish(image)

        def answers(topic: str) -> int:
            return sum(each.header == header(self.number) for each in self.bench.received[topic])

        self.bench.until(lambda: all(map(answers, self.answers)), f'frame {self.number}')
        self.bench.settle()
        assert [answers(topic) for topic in self.answers] == [1] * len(self.answers)
        assert {node.state for node in self.bench.nodes} == {'active'}
        for kept in self.bench.received.values():
            kept.clear()

    def spoil(self, draw: Any, place: int) -> None:
        """Send what a node takes together, with one message spoilt, or that one alone."""
        topics = draw(st.sampled_from(self.sets))
        # Only of a frame that it has seen does the tracker learn, or take a map.
        late_ns = 0 if topics[0] in ('person_0/mask', 'heat_map') else 50_000 * (place + 1)
        about, bad = header(self.number), draw(st.sampled_from(topics))
        about.stamp.nanosec = min(about.stamp.nanosec + late_ns, 999_999_999)
        for topic in topics if draw(st.integers(0, 9)) else (bad,):
            message = draw(spoilt(topic, about)) if topic == bad else good(topic, about)
            self.publishers[topic].publish(message)

    def ask(self, draw: Any) -> None:
        """Ask a node for something odd, or to begin anew."""
        node = draw(st.sampled_from(self.bench.nodes))
        name, value = draw(st.sampled_from(PARAMETERS)), draw(st.sampled_from(VALUES))
        asked = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        answer = self.bench.call(SetParameters, f'{node.get_name()}/set_parameters', asked)
        assert not answer.results[0].successful
        for request in (SetBool.Request(data=False), SetBool.Request(data=True)):
            self.bench.call(SetBool, f'{node.get_name()}/enable', request)
        self.bench.call(Trigger, f'{node.get_name()}/reset', Trigger.Request())


@pytest.fixture(params=['split', 'single', 'compressed'])
def graph(bench: Bench, request: pytest.FixtureRequest) -> Graph:
    made = Graph(bench, request.param)
    made.show()
    return made


@examples(12, 150)
@given(data=st.data())
def test_good_frames_are_answered_once_whatever_comes_between(graph: Graph, data: Any) -> None:
    for place in range(data.draw(st.integers(1, 3))):
        if data.draw(st.integers(0, 6)) == 6:
            graph.ask(data.draw)
        else:
            graph.spoil(data.draw, place)
    graph.show()
