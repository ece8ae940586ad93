# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages that are wrong in a field, in their pixels or alone: every good frame is answered."""

from __future__ import annotations

import copy
import math
from array import array
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from sensor_msgs.msg import CameraInfo, Image, JointState, RegionOfInterest
from std_msgs.msg import Header

from gait_segmentation.encodings import ENCODINGS
from gait_segmentation.geometry import Box
from gait_segmentation.nodes.localizer_node import LocalizerNode
from gait_segmentation.ros.messages import box_message, image_message
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.streams.fields import GAIT_NAMES
from test.hostile import examples
from test.nodes.bench import DEEP, STYLES, Bench, frame, header

BOX = Box(30, 20, 24, 80)
KINDS = {'init_roi': RegionOfInterest, 'image_size': RegionOfInterest, 'camera_info': CameraInfo,
         'person_0/gait': JointState}  # fmt: skip
SETS = (
    ('image',),
    ('init_roi',),
    ('heat_map',),
    ('image_size', 'person_0/box', 'person_0/likelihood'),
    (
        'person_0/likelihood',
        'person_0/matched_box',
        'person_0/shape_prior',
        'person_0/gait',
        'image',
    ),
    ('person_0/mask', 'person_0/shape_prior', 'person_0/matched_box'),
    ('camera_info', 'depth', 'person_0/matched_box', 'person_0/gait', 'person_0/mask'),
)
"""Messages that a node takes together."""

FLOATS = (math.nan, math.inf, -math.inf, 0.0, -1.0, 1e-30, 60.0, 1e7, 3e38)
EXTREMES: dict[str, tuple[Any, ...]] = {
    'boolean': (True, False),
    'uint8': (0, 1, 77, 255),
    'int32': (0, -1, 500, -(2**31), 2**31 - 1),
    'int64': (0, -1, 2**63 - 1, -(2**63)),
    'uint32': (0, 1, 7, 320, 8192, 65_536, 2**31, 2**32 - 1),
    'float': FLOATS,
    'double': (*FLOATS, 1e300),
    'string': ('', 'BGR8', '16UC1', 'h264', '%s%n', 'a\nb', '🙂' * 50, 'a' * 10_000, *ENCODINGS),
}
SHAPES = ((1, 1), (1, 3000), (3000, 1), (3, 500), (120, 160), (480, 640))


def good(topic: str, about: Header) -> Any:
    """Return a message of somebody in a frame."""
    if topic.endswith('box'):
        return box_message(BOX.corners(), 1, about)
    if topic in KINDS:
        given = {} if KINDS[topic] is RegionOfInterest else {'header': about}
        if topic == 'person_0/gait':
            given |= {'name': list(GAIT_NAMES), 'position': [1.0, 0.0], 'effort': [0.9, 0.7]}
        else:
            given |= {'width': 160, 'height': 120}
        return KINDS[topic](**given)
    if topic == 'depth':
        made = Image(header=about, encoding='32FC1', step=640, width=160, height=120)
        made.data.frombytes(np.full((120, 160), 4.0, '<f4').tobytes())
        return made
    return image_message(
        np.full((120, 160, 3)[: 3 if topic == 'image' else 2], 90, np.uint8), about
    )


def leaves(message: Any) -> Iterator[tuple[Any, str]]:
    """Go through the fields of a message, and of those inside, with what they are fields of."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        for inside in value[:4] if isinstance(value, list) else [value]:
            if hasattr(inside, 'get_fields_and_field_types'):
                yield from leaves(inside)
        if not hasattr(value, 'get_fields_and_field_types'):
            yield message, name


def spoilt(draw: Any, message: Any, about: Header) -> Any:
    """Draw a message with an odd value in a field, or odd pixels."""
    if isinstance(message, Image) and draw(st.booleans()):
        shape = (*draw(st.sampled_from(SHAPES)), *draw(st.sampled_from([(), (3,)])))
        return image_message(np.full(shape, draw(st.sampled_from((0, 127, 255))), np.uint8), about)
    inside, name = draw(st.sampled_from(list(leaves(message))))
    value = getattr(inside, name)
    if isinstance(value, np.ndarray):
        value[draw(st.integers(0, len(value) - 1))] = draw(st.sampled_from(EXTREMES['double']))
        return message
    ways: Any = EXTREMES.get(inside.get_fields_and_field_types()[name])
    if isinstance(value, list | array):
        ways = [value[:0], value[:-1], value[:1] * 2, value * (2 if len(value) > 99 else 5000)]
        if isinstance(value, array) and value.typecode == 'd':
            ways += [array('d', [each] * len(value)) for each in FLOATS]
    setattr(inside, name, draw(st.sampled_from(ways)))
    return message


class Graph:
    """Nodes that are shown good frames, with spoilt messages between."""

    def __init__(self, bench: Bench, style: str) -> None:
        self.bench, self.number = bench, 0
        for kind in (*STYLES[style], *([LocalizerNode] if style == 'split' else [])):
            bench.add(kind)
        self.answers = ['person_0/box', 'person_0/likelihood']
        self.answers += ['person_0/gait', 'mask', 'labels'] if style == 'single' else []
        bench.record_outputs(*self.answers)
        read = {each.topic_name for node in bench.nodes for each in node.subscriptions}
        self.sets = [each for each in SETS if read >= {f'/{topic}' for topic in each}]
        self.publishers = {}
        for topic in {topic for each in self.sets for topic in each}:
            profile = LATCHED if topic == 'image_size' else DEEP
            self.publishers[topic] = bench.publisher(
                type(good(topic, Header())), topic, 1, profile
            )

    def show(self) -> None:
        """Show a good frame: it is answered once."""
        self.number += 1
        image = frame(self.number % 20)
        image.header = header(self.number)
        self.publishers['image'].publish(image)

        def count(topic: str) -> int:
            return sum(each.header == image.header for each in self.bench.received[topic])

        self.bench.until(lambda: all(map(count, self.answers)), f'frame {self.number}')
        self.bench.settle()
        assert [count(topic) for topic in self.answers] == [1] * len(self.answers)
        assert {node.state for node in self.bench.nodes} == {'active'}

    def spoil(self, draw: Any, place: int) -> None:
        """Send what a node takes together, with one message spoilt, or that one alone."""
        topics = draw(st.sampled_from(self.sets))
        # Only of a frame that it has seen does the tracker learn, or take a map.
        late_ns = 0 if topics[0] in ('person_0/mask', 'heat_map') else 50_000 * (place + 1)
        about, bad = header(self.number), draw(st.sampled_from(topics))
        about.stamp.nanosec = min(about.stamp.nanosec + late_ns, 999_999_999)
        for topic in topics if draw(st.integers(0, 9)) else (bad,):
            # Its header, too, may be what is spoilt.
            own = copy.deepcopy(about)
            message = good(topic, own)
            self.publishers[topic].publish(spoilt(draw, message, own) if topic == bad else message)


@pytest.fixture(params=['split', 'single'])
def graph(bench: Bench, request: pytest.FixtureRequest) -> Graph:
    made = Graph(bench, request.param)
    made.publishers['init_roi'].publish(
        RegionOfInterest(x_offset=30, y_offset=20, width=24, height=80)
    )
    made.show()
    return made


@examples(15, 150)
@given(data=st.data())
def test_good_frames_are_answered_once_whatever_comes_between(graph: Graph, data: Any) -> None:
    for place in range(data.draw(st.integers(1, 3))):
        graph.spoil(data.draw, place)
    graph.show()
