# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is published and read again, with classes made from the definitions of vision_msgs."""

from __future__ import annotations

import dataclasses
import math
import sys
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from geometry_msgs.msg import Point32, PolygonInstanceStamped, PoseWithCovariance
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from gait_segmentation.drawing import track_colour
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.localization import Location
from gait_segmentation.nodes.camera_node import read_detections
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
from gait_segmentation.ros.messages import (
    Outputs,
    Person,
    box_message,
    detection_types,
    gait_message,
    markers_message,
    mask_topics,
    match_topics,
    people_message,
    picture_topics,
    pose_message,
    seen,
    track_topics,
    tracks_message,
)
from gait_segmentation.segmentation import PeopleMasks
from gait_segmentation.streams.config import StartConfig
from gait_segmentation.streams.fields import (
    matched_corners,
    read_body,
    read_box,
    read_gait,
    stamp_of,
    tilted_corners,
)


def header(stamp_ns: int = 1) -> Header:
    made = Header(frame_id='camera')
    made.stamp.sec, made.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    return made


BODY = BodyFrame(20, 40, 60)
GREY = np.full((6, 8), 9, np.uint8)


def match(
    body: BodyFrame | None = BODY, phase: float = 0.25, azimuth: float = 1.0, track_id: int = 3
) -> MatchResult:
    return MatchResult(1, track_id, body, None, 3, 7, phase, 0.9, azimuth, 0.5, 0.25, GREY)


@given(st.integers(1, 2**31 * 10**9 - 1))
def test_stamps_are_exact(stamp_ns) -> None:
    assert stamp_of(header(stamp_ns)) == stamp_ns


@given(
    st.floats(-50, 2000),
    st.floats(-50, 2000),
    st.floats(2, 500),
    st.floats(2, 900),
    st.floats(-0.6, 0.6),
)
def test_boxes_return_with_their_tilt(x, y, width, height, angle) -> None:
    sent = box_message(tilted_corners(Box(x, y, width, height), angle), 7, header())
    assert sent.polygon.id == 7
    box, tilt = read_box(sent)
    np.testing.assert_allclose(
        (box.x, box.y, box.width, box.height), (x, y, width, height), atol=2e-3
    )
    assert tilt == pytest.approx(angle, abs=2e-3)


def test_boxes_upright_in_another_order_and_of_nobody() -> None:
    box = Box(1.3, 2.7, 33.1, 77.7)
    assert read_box(box_message(tilted_corners(box, 0.0), 7, header()))[1] == 0
    corners = Box(10, 20, 30, 60).corners()
    sent = box_message(corners[2:] + corners[:2], 7, header())
    assert read_box(sent) == (Box(10, 20, 30, 60), 0.0)
    nobody = box_message((), 0, header())
    assert read_box(nobody) == (None, 0.0)
    assert read_body(nobody) is None


@pytest.mark.parametrize(
    'points', [[(0, 0)], [(0, 0), (1, 0), (1, math.nan), (0, 1)], [(1, 1)] * 4]
)
def test_polygons_that_are_no_box_are_refused(points) -> None:
    message = PolygonInstanceStamped()
    message.polygon.polygon.points = [Point32(x=float(x), y=float(y)) for x, y in points]
    with pytest.raises(InputError):
        read_box(message)


@given(st.floats(0, 0.999), st.floats(-3.14, 3.14))
def test_the_gait_returns(phase, azimuth) -> None:
    sent = gait_message(match(BODY, phase, azimuth), header())
    found = read_gait(sent)
    assert found == (pytest.approx(phase), pytest.approx(0.9), pytest.approx(azimuth), 0.5)
    named = dict(zip(sent.name, zip(sent.position, sent.effort, strict=True), strict=True))
    assert named['gait_phase'][1] == 0.25
    assert named['view_azimuth'][1] == 0.5
    assert named['template_sequence'] == (3, 0.5)
    assert named['template_phase'] == (7, 0.5)


def test_a_gait_may_be_nobodys_or_lack_what_it_need_not_have() -> None:
    sent = gait_message(match(None), header())
    assert list(sent.name) == []
    assert read_gait(sent) == (0.0, 0.0, 0.0, 0.0)
    with pytest.raises(InputError, match='gait_phase and view_azimuth'):
        read_gait(JointState(name=['knee'], position=[1.0]))
    sent = gait_message(match(), header())
    sent.effort = []
    # That of the template is believed.
    assert read_gait(sent)[3] == 1.0
    for field in ('position', 'velocity', 'effort'):
        sent = gait_message(match(), header())
        setattr(sent, field, [float('nan')] * 2)
        with pytest.raises(InputError, match='finite'):
            read_gait(sent)


def test_a_matched_box_is_the_placed_one_along_the_axis_of_the_body() -> None:
    placed = Box.from_center(100, 200, 50, 180)
    upright = dataclasses.replace(match(BodyFrame(100, 200, 180)), placed=placed)
    assert matched_corners(upright) == placed.corners()
    turned = dataclasses.replace(upright, body=BodyFrame(100, 200, 180, math.pi / 2))
    frame, width = BodyFrame.from_corners(matched_corners(turned))
    assert (frame.height, frame.angle, width) == pytest.approx((180, math.pi / 2, 50))


DEFINITIONS = {
    'Point2D': 'float64 x\nfloat64 y',
    'Pose2D': 'vision_msgs/Point2D position\nfloat64 theta',
    'BoundingBox2D': 'vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y',
    'ObjectHypothesis': 'string class_id\nfloat64 score',
    'ObjectHypothesisWithPose': 'ObjectHypothesis hypothesis\n'
    'geometry_msgs/PoseWithCovariance pose',
    'Detection2D': 'std_msgs/Header header\nObjectHypothesisWithPose[] results\n'
    'BoundingBox2D bbox\nstring id',
    'Detection2DArray': 'std_msgs/Header header\nDetection2D[] detections',
}
HEADER = header(3_000_000_000)


@pytest.fixture(scope='module')
def store() -> Any:
    made = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        made.register(get_types_from_msg(text, f'vision_msgs/msg/{name}'))
    return made


@pytest.fixture
def types(store: Any) -> SimpleNamespace:
    named = {name: store.types[f'vision_msgs/msg/{name}'] for name in DEFINITIONS}
    # Messages of rclpy have defaults.
    named['Pose2D'] = partial(named['Pose2D'], theta=0.0)
    result = named['ObjectHypothesisWithPose']
    named['ObjectHypothesisWithPose'] = lambda hypothesis: result(hypothesis, PoseWithCovariance())
    return SimpleNamespace(**named)


def location(heading: tuple[float, float, float] = (-1, 0, 0), **changes: Any) -> Location:
    about = {
        'track_id': 7,
        'position': np.array([0.5, 1.2, 5.0]),
        'covariance': np.diag([0.01, 0.02, 0.03]),
        'heading': np.array(heading, float),
        'up': np.array([0.0, -1.0, 0.0]),
        'yaw': 1.5,
        'heading_error': 0.2,
        'speed': 1.3,
        'step_length': None,
        'stature': 1.75,
        'distance': 4.5,
        'source': 'depth',
    }
    return Location(**{**about, **changes})


def people() -> list[Person]:
    found = []
    for track_id, where in ((7, location()), (9, None)):
        found.append(Person(match(BODY, track_id=track_id), Box(10, 20, 30, 80), where))
    return found


def sent(store: Any, message: Any, name: str) -> Any:
    kind = f'vision_msgs/msg/{name}'
    return store.deserialize_cdr(store.serialize_cdr(message, kind), kind)


def numbers(detection: Any) -> dict[str, float]:
    return {each.hypothesis.class_id: each.hypothesis.score for each in detection.results}


def test_everybody_is_in_one_message_with_what_is_known_by_name(store, types) -> None:
    message = sent(store, people_message(people(), HEADER, types), 'Detection2DArray')
    first, second = message.detections
    assert (first.id, second.id) == ('7', '9')
    assert message.header.frame_id == first.header.frame_id == 'camera'
    assert (first.bbox.center.position.x, first.bbox.center.position.y) == (25.0, 60.0)
    assert (first.bbox.size_x, first.bbox.size_y) == (30.0, 80.0)
    walk = {'person': 0.5, 'phase': 0.25, 'cadence': 0.9, 'view_azimuth': 1.0}
    assert numbers(first) == {**walk, 'heading': 1.5, 'speed': 1.3}
    assert numbers(second) == walk
    assert first.results[0].pose.pose.position.z == 5.0
    assert first.results[0].pose.covariance[14] == pytest.approx(0.03)


def test_markers_have_the_colours_of_the_tracks() -> None:
    _, body, heading, about = markers_message(people(), HEADER).markers
    known = [255 * body.color.b, 255 * body.color.g, 255 * body.color.r]
    assert known == pytest.approx(track_colour(7), abs=0.01)
    assert [each.color.a for each in (body, heading, about)] == [0.5, 1.0, 1.0]
    assert (body.scale.x, body.scale.y, body.scale.z, heading.scale.x) == (0.5, 0.5, 1.75, 1.0)
    # Up is against y: the middle of the body, and words above the head.
    for marker, up in ((body, 1.75 / 2), (heading, 1.75 / 2), (about, 1.95)):
        at = marker.pose.position
        assert (at.x, at.y, at.z) == pytest.approx((0.5, 1.2 - up, 5.0))
    assert about.text == '7  4.5 m  1.3 m/s'


def track(track_id: int, box: Box | None, confidence: float = 0.75) -> TrackResult:
    return TrackResult(5, track_id, box, np.zeros((2, 2), np.uint8), confidence, 0.1)


def test_tracks_go_out_field_by_field(store: Any, types: SimpleNamespace) -> None:
    header = store.types['std_msgs/msg/Header'](
        stamp=store.types['builtin_interfaces/msg/Time'](sec=3, nanosec=4), frame_id='camera'
    )
    tracks = [track(7, Box(10, 20, 30, 80)), track(0, None), track(8, None)]
    message = tracks_message(tracks, header, types)
    message = sent(store, message, 'Detection2DArray')
    (one,) = message.detections
    assert message.header == one.header == header
    assert one.id == '7'
    assert (one.bbox.center.position.x, one.bbox.center.position.y) == (25.0, 60.0)
    assert (one.bbox.size_x, one.bbox.size_y, one.bbox.center.theta) == (30.0, 80.0, 0.1)
    (result,) = one.results
    assert (result.hypothesis.class_id, result.hypothesis.score) == ('person', 0.75)
    assert read_detections(message, StartConfig()) == [Box(10, 20, 30, 80)]


def test_the_package_is_used_where_it_is_and_else_there_are_no_detections(
    monkeypatch, types
) -> None:
    monkeypatch.setitem(sys.modules, 'vision_msgs', None)
    monkeypatch.setitem(sys.modules, 'vision_msgs.msg', None)
    assert detection_types() is None
    module = ModuleType('vision_msgs.msg')
    for name in DEFINITIONS:
        setattr(module, name, getattr(types, name))
    monkeypatch.setitem(sys.modules, 'vision_msgs', ModuleType('vision_msgs'))
    monkeypatch.setitem(sys.modules, 'vision_msgs.msg', module)
    found = detection_types()
    assert found is not None
    assert found.Detection2DArray is types.Detection2DArray


def test_the_heading_is_uncertain_about_the_vertical() -> None:
    up = np.array([0.0, -0.8, 0.6])
    message = pose_message(location(up=up, heading_error=0.2), HEADER)
    turn = message.pose.covariance.reshape(6, 6)[3:, 3:]
    assert up @ turn @ up == pytest.approx(0.2**2, abs=2e-4)
    assert np.trace(turn) == pytest.approx(0.2**2, abs=4e-4)


class _Publisher:
    def __init__(self, node: _Node, topic: str) -> None:
        self._node = node
        self._topic = topic

    def get_subscription_count(self) -> int:
        return int(self._topic in self._node.heard)

    def publish(self, message: Any) -> None:
        self._node.published.append((self._topic, message))


class _Node:
    """Takes the place of a node, some of whose topics are heard."""

    def __init__(self, *heard: str) -> None:
        self.heard = heard
        self.published: list[tuple[str, Any]] = []

    def output(self, kind: Any, topic: str, *_: Any) -> Any:
        return _Publisher(self, topic)

    @property
    def topics(self) -> list[str]:
        return [topic for topic, _ in self.published]


SLOTS = 2
TRACKS = [track(k, Box(1, 2, 3, 4)) for k in (1, 2)]
MATCHES = [match(track_id=k) for k in (1, 2)]


def _masks() -> PeopleMasks:
    return PeopleMasks(tuple(SegmentationResult(5, k, GREY, '') for k in (1, 2)), GREY, GREY)


def test_only_what_is_heard_is_published() -> None:
    node: Any = _Node('person_1/likelihood')
    Outputs(node, track_topics(SLOTS)).publish(TRACKS, HEADER)
    assert node.topics == ['person_1/likelihood']
    node = _Node('person_0/gait', 'person_1/refined_box')
    Outputs(node, match_topics(SLOTS)).publish(MATCHES, HEADER)
    assert node.topics == ['person_0/gait', 'person_1/refined_box']
    node = _Node('labels', 'mask', 'person_1/mask')
    Outputs(node, mask_topics(SLOTS)).publish(_masks(), HEADER)
    assert node.topics == ['mask', 'person_1/mask', 'labels']


def test_empty_answers_are_one_image_for_all_who_listen() -> None:
    node: Any = _Node('mask', 'labels', 'person_1/mask')
    Outputs(node, mask_topics(SLOTS)).blank((6, 8), HEADER)
    assert sorted(node.topics) == ['labels', 'mask', 'person_1/mask']
    messages = [message for _, message in node.published]
    assert {(each.width, each.height, any(each.data)) for each in messages} == {(8, 6, False)}
    assert all(each is messages[0] for each in messages)
    assert messages[0].header == HEADER
    node = _Node('person_0/gait', 'person_1/shape_prior', 'person_1/refined_box')
    Outputs(node, match_topics(SLOTS)).blank((6, 8), HEADER)
    assert sorted(node.topics) == ['person_0/gait', 'person_1/refined_box', 'person_1/shape_prior']


@pytest.mark.parametrize('heard', ['debug_image', 'debug_image/compressed'])
def test_a_picture_goes_out_as_it_is_listened_to(heard: str) -> None:
    node: Any = _Node(heard)
    outputs = Outputs(node, picture_topics())
    picture = np.full((16, 16, 3), (10, 120, 200), np.uint8)
    outputs.publish_made(HEADER, lambda: picture)
    ((topic, message),) = node.published
    assert topic == heard
    outputs.blank((0, 0, 3), HEADER)
    assert len(node.published[-1][1].data) == 0
    if heard != 'debug_image':
        assert message.format == 'bgr8; jpeg compressed bgr8'
        np.testing.assert_allclose(_decoded(message), picture, atol=4)
    drawn: list[int] = []
    nobody: Any = _Node()
    Outputs(nobody, picture_topics()).publish_made(HEADER, lambda: drawn.append(1))
    assert not drawn


def _decoded(message: Any) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_UNCHANGED)


def test_who_is_not_matched_is_not_seen_whatever_their_mask_shows() -> None:
    first, second = MATCHES
    (person,) = seen([first, dataclasses.replace(second, body=None)], [GREY, GREY], [None, None])[
        0
    ]
    assert (person.match.track_id, person.box) == (1, Box(0, 0, 8, 6))
