# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detections, with message classes made from the definitions of vision_msgs."""

from __future__ import annotations

import sys
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from gait_segmentation.geometry import Box
from gait_segmentation.results import TrackResult
from gait_segmentation.ros.config import DetectionConfig
from gait_segmentation.ros.vision import (
    detection_types,
    detections_message,
    new_people,
    read_detections,
)

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
KIND = 'vision_msgs/msg/Detection2DArray'


@pytest.fixture(scope='module')
def store() -> Any:
    made = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        made.register(get_types_from_msg(text, f'vision_msgs/msg/{name}'))
    return made


@pytest.fixture
def types(store: Any) -> SimpleNamespace:
    classes = store.types

    made = {name: classes[f'vision_msgs/msg/{name}'] for name in DEFINITIONS}
    position = classes['geometry_msgs/msg/Point'](0.0, 0.0, 0.0)
    turn = classes['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0)
    where = classes['geometry_msgs/msg/Pose'](position, turn)
    pose = classes['geometry_msgs/msg/PoseWithCovariance'](where, np.zeros(36))
    # Messages of rclpy have defaults.
    made['ObjectHypothesisWithPose'] = partial(made['ObjectHypothesisWithPose'], pose=pose)
    return SimpleNamespace(**made)


def track(track_id: int, box: Box | None, confidence: float = 0.75) -> TrackResult:
    return TrackResult(5, track_id, box, np.zeros((2, 2), np.uint8), confidence, 0.1)


def test_tracks_go_out_field_by_field(store: Any, types: SimpleNamespace) -> None:
    header = store.types['std_msgs/msg/Header'](
        stamp=store.types['builtin_interfaces/msg/Time'](sec=3, nanosec=4), frame_id='camera'
    )
    tracks = [track(7, Box(10, 20, 30, 80)), track(0, None), track(8, None)]
    message = detections_message(tracks, header, types)
    sent = store.deserialize_cdr(store.serialize_cdr(message, KIND), KIND)
    (one,) = sent.detections
    assert sent.header == one.header == header
    assert one.id == '7'
    assert (one.bbox.center.position.x, one.bbox.center.position.y) == (25.0, 60.0)
    assert (one.bbox.size_x, one.bbox.size_y, one.bbox.center.theta) == (30.0, 80.0, 0.1)
    (result,) = one.results
    assert (result.hypothesis.class_id, result.hypothesis.score) == ('person', 0.75)
    assert read_detections(sent, DetectionConfig()) == [Box(10, 20, 30, 80)]


def detection(score: float, box: tuple[float, ...], name: str = 'person') -> Any:
    x, y, width, height = box
    hypothesis = SimpleNamespace(class_id=name, score=score)
    center = SimpleNamespace(position=SimpleNamespace(x=x, y=y), theta=0.0)
    return SimpleNamespace(
        results=[SimpleNamespace(hypothesis=hypothesis)],
        bbox=SimpleNamespace(center=center, size_x=width, size_y=height),
    )


def test_people_come_in_the_surest_first() -> None:
    nothing = detection(0.9, (5, 5, 4, 4))
    nothing.results = []
    message = SimpleNamespace(
        detections=[
            detection(0.6, (50, 50, 20, 40)),
            detection(0.9, (10, 20, 4, 8)),
            detection(0.4, (10, 20, 4, 9)),
            detection(0.9, (10, 20, 0, 8)),
            detection(0.9, (float('nan'), 20, 4, 8)),
            detection(0.99, (10, 20, 4, 8), 'dog'),
            nothing,
        ]
    )
    assert read_detections(message, DetectionConfig()) == [Box(8, 16, 4, 8), Box(40, 30, 20, 40)]
    every = read_detections(message, DetectionConfig(detection_class='', detection_score=0.95))
    assert every == [Box(8, 16, 4, 8)]


def test_only_new_people_start_and_only_in_free_slots() -> None:
    known, near, far = Box(10, 10, 20, 60), Box(12, 11, 20, 60), Box(100, 10, 20, 60)
    further = Box(200, 10, 20, 60)
    assert new_people([near, far], [track(1, known), track(0, None)], 2) == [far]
    assert new_people([near, far], [track(1, known)], 1) == []
    assert new_people([far, far, further], [], 3) == [far, further]
    assert new_people([far, further], [track(3, None)], 2) == [far]
    # What another message has asked for just before takes a slot, too.
    assert new_people([far, further], [], 3, [far]) == [further]
    assert new_people([far, further], [], 1, [near]) == []


def test_without_the_package_there_are_no_detections(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, 'vision_msgs', None)
    monkeypatch.setitem(sys.modules, 'vision_msgs.msg', None)
    assert detection_types() is None


def test_the_package_is_used_where_it_is(monkeypatch, types: SimpleNamespace) -> None:
    pytest.importorskip('geometry_msgs')
    module = ModuleType('vision_msgs.msg')
    for name in DEFINITIONS:
        setattr(module, name, getattr(types, name))
    monkeypatch.setitem(sys.modules, 'vision_msgs', ModuleType('vision_msgs'))
    monkeypatch.setitem(sys.modules, 'vision_msgs.msg', module)
    found = detection_types()
    assert found is not None
    assert found.Detection2DArray is types.Detection2DArray
