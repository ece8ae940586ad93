# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from geometry_msgs.msg import Point32, PolygonInstanceStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.messages import box_message, gait_message
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


def match(body: BodyFrame | None, phase: float = 0.25, azimuth: float = 1.0) -> MatchResult:
    prior = np.zeros((2, 2), np.uint8)
    return MatchResult(1, 3, body, None, 3, 7, phase, 0.9, azimuth, 0.5, 0.25, prior)


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
    sent = gait_message(match(BodyFrame(1, 2, 3), phase, azimuth), header())
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
    sent = gait_message(match(BodyFrame(1, 2, 3)), header())
    sent.effort = []
    # That of the template is believed.
    assert read_gait(sent)[3] == 1.0
    for field in ('position', 'velocity', 'effort'):
        sent = gait_message(match(BodyFrame(1, 2, 3)), header())
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
