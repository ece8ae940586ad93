# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One message about everybody, with classes made from the definitions of vision_msgs."""

from __future__ import annotations

import sys
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovariance
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from std_msgs.msg import Header

from gait_segmentation.drawing import track_colour
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.localization import Location
from gait_segmentation.nodes.camera_node import read_detections
from gait_segmentation.results import MatchResult, TrackResult
from gait_segmentation.ros.messages import (
    Person,
    boxes_message,
    detection_types,
    markers_message,
    people_message,
    pose_message,
    tracks_message,
)
from gait_segmentation.streams.config import StartConfig

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
HEADER = Header(frame_id='camera')
HEADER.stamp.sec = 3


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
        body = BodyFrame(20, 40, 60)
        walk = 0, 0, 0.25, 0.9, 3.0, 0.75, 0.5, np.zeros((1, 1), np.uint8)
        match = MatchResult(5, track_id, body, None, *walk)
        found.append(Person(match, Box(10, 20, 30, 80), where))
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
    walk = {'person': 0.75, 'phase': 0.25, 'cadence': 0.9, 'view_azimuth': 3.0}
    assert numbers(first) == {**walk, 'heading': 1.5, 'speed': 1.3}
    assert numbers(second) == walk
    assert first.results[0].pose.pose.position.z == 5.0
    assert first.results[0].pose.covariance[14] == pytest.approx(0.03)


def test_boxes_and_markers_have_the_colours_of_the_tracks() -> None:
    boxes = boxes_message(people(), HEADER)
    assert (len(boxes.points), len(boxes.outline_colors)) == (16, 8)
    assert [(p.x, p.y) for p in boxes.points[:3]] == [(10, 20), (40, 20), (40, 20)]
    _, body, heading, about = markers_message(people(), HEADER).markers
    for track_id, colours in (
        (7, [body.color, *boxes.outline_colors[:4]]),
        (9, boxes.outline_colors[4:]),
    ):
        for each in colours:
            known = [255 * each.b, 255 * each.g, 255 * each.r]
            assert known == pytest.approx(track_colour(track_id), abs=0.01)
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
