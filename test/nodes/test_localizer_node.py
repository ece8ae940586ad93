# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where people are as messages, in a node of its own and in gait_pipeline."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import CameraInfo, Image, JointState, RegionOfInterest
from std_srvs.srv import Trigger
from visualization_msgs.msg import ImageMarker, Marker, MarkerArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.nodes.localizer_node import LocalizerNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.ros.messages import box_message, image_message
from test.nodes.bench import Bench, frame, header

SIZE = (160, 120)
OUTPUTS = {
    'person_0/pose': PoseWithCovarianceStamped,
    'person_0/walk': JointState,
    'markers': MarkerArray,
    'boxes': ImageMarker,
}
AWAY_M, FOCAL = 4.0, 160.0
GROUND_Y = 1.0


def info(**changes: Any) -> CameraInfo:
    focal = changes.pop('focal', FOCAL)
    k = [focal, 0.0, 79.5, 0.0, focal, 59.5, 0.0, 0.0, 1.0]
    about = {'header': header(0), 'width': SIZE[0], 'height': SIZE[1], 'k': k}
    return CameraInfo(**{**about, **changes})


def depth(index: int, metres: float = AWAY_M, **changes: Any) -> Image:
    values = np.full(SIZE[::-1], 1000 * metres, np.uint16)
    message = Image(header=header(index), height=SIZE[1], width=SIZE[0], encoding='16UC1')
    message.step, message.data = 2 * SIZE[0], values.tobytes()
    for name, value in changes.items():
        setattr(message, name, value)
    return message


class Places:
    """A localizer to which parts of frames are handed over in the process."""

    def __init__(self, bench: Bench, **parameters: Any) -> None:
        self.bench = bench
        self.node = bench.add(LocalizerNode, **parameters)
        for topic, kind in OUTPUTS.items():
            bench.record(kind, topic)
        for each in self.node._outputs:
            if each.topic_name.lstrip('/') in OUTPUTS:
                bench.until(lambda p=each: p.get_subscription_count() > 0, each.topic_name)

    def show(self, index: int, track_id: int = 7, size: tuple[int, int] = SIZE) -> dict:
        """Hand over somebody who crosses 4 m away; return what comes."""
        before = {topic: len(self.bench.received[topic]) for topic in OUTPUTS}
        about = header(index)
        # Soles 1 m below the camera, in the middle at the frame 0, 1.2 m/s to the right.
        x = 80 + 40 * 0.04 * index
        body = BodyFrame(x, 60 + 40 * GROUND_Y - 34, 68)
        mask = np.zeros(size[::-1], np.uint8)
        mask[35:98, int(x) - 8 : int(x) + 8] = 255
        gait = JointState(header=about, name=['gait_phase', 'view_azimuth'], position=[0.0, 0.0])
        gait.velocity, gait.effort = [2 * np.pi * 0.8, 0.0], [1.0, 0.9]
        corners = body.corners(20) if track_id else ()
        self.node._part('person_0/matched_box', box_message(corners, track_id, about))
        self.node._part('person_0/gait', gait if track_id else JointState(header=about))
        self.node._part('person_0/mask', image_message(mask, about))
        self.bench.settle()
        return {topic: self.bench.received[topic][count:] for topic, count in before.items()}


def test_somebody_is_where_depth_says_and_walks_as_seen(bench: Bench) -> None:
    places = Places(bench)
    places.node._localizing._calibrated(info())
    for index in range(40):
        places.node._localizing._depths.append(depth(index))
        new = places.show(index)
        for topic in ('person_0/pose', 'person_0/walk', 'boxes'):
            (message,) = new[topic]
            assert message.header == header(index)
    pose = new['person_0/pose'][0].pose
    at, turn = pose.pose.position, pose.pose.orientation
    away = AWAY_M + 0.14
    assert (at.x, at.y, at.z) == pytest.approx((0.04 * 39 * 1.035, away / 4, away), abs=0.03)
    # Ahead is to the right, and up is up: x stays, y becomes z, and z becomes -y.
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0.707, 0, 0, 0.707), abs=0.05)
    assert np.linalg.eigvalsh(np.reshape(pose.covariance, (6, 6))).min() > 0
    walk = new['person_0/walk'][0]
    known = dict(zip(walk.name, walk.position, strict=True))
    assert known['speed'] == pytest.approx(1.2, rel=0.06)
    assert known['step_length'] == pytest.approx(known['speed'] / 1.6)
    assert known['heading'] == pytest.approx(-np.pi / 2, abs=0.05)
    (shown,) = new['markers']
    assert [each.action for each in shown.markers] == [Marker.DELETEALL, *[Marker.ADD] * 3]
    assert {each.header.frame_id for each in shown.markers} == {'head_camera'}
    assert [each.id for each in shown.markers[1:]] == [7, 7, 7]
    assert len(new['boxes'][0].points) == 8


def test_without_depth_the_ground_says_where(bench: Bench) -> None:
    places = Places(bench, **{'localization.camera_height': GROUND_Y})
    places.node._localizing._calibrated(info())
    (pose,) = places.show(0)['person_0/pose']
    at = pose.pose.pose.position
    assert (at.x, at.y, at.z) == pytest.approx((0.0, GROUND_Y, AWAY_M), abs=0.02)


def test_nobody_has_no_pose_and_old_markers_go(bench: Bench) -> None:
    places = Places(bench)
    places.node._localizing._calibrated(info())
    new = places.show(0, track_id=0)
    assert (new['person_0/pose'], new['person_0/walk']) == ([], [])
    assert [each.action for each in new['markers'][0].markers] == [Marker.DELETEALL]
    assert new['boxes'][0].action == ImageMarker.REMOVE


UNUSABLE = {
    'no camera_info': (None, {}, 'nobody is located: nothing came on /camera_info so far'),
    'size': (info(width=320, height=240), {}, 'camera_info is of images of 320 x 240, but'),
    'focal': (info(focal=0.0), {}, 'focal lengths above zero, got fx 0, fy 0'),
    'model': (
        info(distortion_model='equidistant', d=[0.1] * 4),
        {},
        "must be plumb_bob or rational_polynomial, got 'equidistant'",
    ),
    'depth size': (info(), {'width': 80, 'step': 160}, 'the size of the image, 160 x 120, got 80'),
    'frame': (info(), {'header': header(0)}, "its frame_id is 'depth', the image's 'head_camera'"),
    'encoding': (info(), {'encoding': 'rgb8'}, "16UC1, mono16, 32FC1, got 'rgb8'"),
    'short': (
        info(),
        {'data': b'123'},
        'at least 38400 bytes for 160 x 120 pixels of 16UC1 with step 320, got 3',
    ),
    'late': (info(), {'header': header(9)}, 'the nearest of the last is 0.300 s apart'),
}
UNUSABLE['frame'][1]['header'].frame_id = 'depth'


@pytest.mark.parametrize('name', UNUSABLE)
def test_what_does_not_fit_is_said_once_and_boxes_go_on(bench: Bench, name: str, capfd) -> None:
    about, changes, said = UNUSABLE[name]
    places = Places(bench)
    if about is not None:
        places.node._localizing._calibrated(about)
    places.node._localizing._depths.append(depth(0, **changes))
    for index in range(3):
        new = places.show(index if name != 'late' else 0)
        assert new['person_0/pose'] == []
        assert len(new['boxes'][0].points) == 8
    assert capfd.readouterr().err.count(said) == 1
    assert places.node.statistics.failed == 0


def test_without_depth_and_ground_it_is_said_what_is_missing(bench: Bench, capfd) -> None:
    places = Places(bench)
    places.node._localizing._calibrated(info())
    assert places.show(0)['person_0/pose'] == []
    said = capfd.readouterr().err
    assert 'nobody is located: nothing came on /depth so far, and where the ground is' in said


def test_float_depth_of_the_other_byte_order_is_metres(bench: Bench) -> None:
    places = Places(bench)
    places.node._localizing._calibrated(info())
    values = np.full(SIZE[::-1], AWAY_M, '>f4')
    values[::2] = np.nan
    big = {'encoding': '32FC1', 'is_bigendian': 1, 'step': 4 * SIZE[0], 'data': values.tobytes()}
    places.node._localizing._depths.append(depth(0, **big))
    (pose,) = places.show(0)['person_0/pose']
    assert pose.pose.pose.position.z == pytest.approx(AWAY_M + 0.14, abs=0.01)


def test_a_rectified_image_has_the_camera_of_p(bench: Bench) -> None:
    places = Places(bench, rectified=True, **{'localization.camera_height': GROUND_Y})
    p = [FOCAL, 0.0, 79.5, 0.0, 0.0, FOCAL, 59.5, 0.0, 0.0, 0.0, 1.0, 0.0]
    given = info(focal=1.0, p=p, distortion_model='equidistant', d=[0.1] * 4)
    places.node._localizing._calibrated(given)
    assert places.show(0)['person_0/pose'][0].pose.pose.position.z == pytest.approx(4, abs=0.02)


class UnknownError(Exception):
    pass


def tf2(monkeypatch: pytest.MonkeyPatch, lookup: Any) -> list[str]:
    """Put a module in the place of tf2_ros; return what becomes of its listener."""
    events: list[str] = []
    module: Any = ModuleType('tf2_ros')
    module.TransformException = UnknownError
    module.Buffer = lambda: SimpleNamespace(lookup_transform=lookup)
    module.TransformListener = lambda *_, **__: SimpleNamespace(
        unregister=lambda: events.append('closed')
    )
    monkeypatch.setitem(sys.modules, 'tf2_ros', module)
    return events


def test_tf_says_where_the_ground_is(bench: Bench, monkeypatch, capfd) -> None:
    known = SimpleNamespace(
        translation=SimpleNamespace(x=5.0, y=6.0, z=GROUND_Y),
        rotation=SimpleNamespace(x=-0.5, y=0.5, z=-0.5, w=0.5),
    )

    def lookup(target: str, source: str, when: Any) -> Any:
        assert (target, source) == ('odom', 'head_camera')
        if when.nanoseconds:  # Only the newest is there.
            raise UnknownError('too new')
        return SimpleNamespace(transform=known)

    events = tf2(monkeypatch, lookup)
    places = Places(bench, ground_frame='odom')
    places.node._localizing._calibrated(info())
    (pose,) = places.show(0)['person_0/pose']
    at = pose.pose.pose.position
    # In the frame of the camera, wherever that is.
    assert (at.x, at.y, at.z) == pytest.approx((0.0, GROUND_Y, AWAY_M), abs=0.02)
    places.node.trigger_deactivate()
    assert events == ['closed']
    assert 'nobody is located' not in capfd.readouterr().err


def test_a_way_that_tf_does_not_know_is_said(bench: Bench, monkeypatch, capfd) -> None:
    def lookup(*_: Any) -> Any:
        raise UnknownError('odom does not exist')

    tf2(monkeypatch, lookup)
    places = Places(bench, ground_frame='odom')
    places.node._localizing._calibrated(info())
    new = places.show(0)
    assert (len(new['boxes']), new['person_0/pose']) == (1, [])
    said = capfd.readouterr().err
    assert "tf has no way from 'head_camera' to 'odom': odom does not exist" in said


def test_without_tf2_it_is_said_what_is_missing(bench: Bench, monkeypatch, capfd) -> None:
    monkeypatch.setitem(sys.modules, 'tf2_ros', None)
    places = Places(bench, ground_frame='odom')
    places.node._localizing._calibrated(info())
    assert places.show(0)['person_0/pose'] == []
    assert 'ground_frame needs the Python package tf2_ros' in capfd.readouterr().err


def test_the_pipeline_locates_if_asked_to(bench: Bench) -> None:
    node = bench.add(PipelineNode, localize=True, **{'localization.camera_height': 1.0})
    poses = bench.record(PoseWithCovarianceStamped, 'person_0/pose')
    boxes = bench.record(ImageMarker, 'boxes')
    camera = bench.publisher(Image, 'image', 1)
    bench.publisher(CameraInfo, 'camera_info', 1).publish(info())
    starter = bench.publisher(RegionOfInterest, 'init_roi', 1)
    starter.publish(RegionOfInterest(x_offset=30, y_offset=20, width=24, height=80))
    bench.until(lambda: node._localizing._info is not None, 'camera_info')
    bench.settle()
    for index in range(4):
        camera.publish(frame(index))
        bench.until(lambda count=index + 1: len(boxes) == count, 'boxes')
    bench.settle()
    assert [each.header for each in poses] == [header(index) for index in range(4)]
    # Soles in the row 100 of a camera that is 1 m high.
    assert 3.3 < poses[-1].pose.pose.position.z < 4.7
    node._reset(Trigger.Request(), Trigger.Response())
    camera.publish(frame(4))
    bench.until(lambda: len(boxes) == 5, 'boxes')
    assert boxes[-1].points == []
    assert len(poses) == 4
