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
from sensor_msgs.msg import CameraInfo, Image, JointState
from visualization_msgs.msg import Marker, MarkerArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.nodes.localizer_node import LocalizerNode
from gait_segmentation.ros.messages import box_message, image_message
from gait_segmentation.ros.qos import BEST_EFFORT
from test.nodes.bench import Bench, header
from test.state import differences, remembered

SIZE = (160, 120)
OUTPUTS = {
    'person_0/pose': PoseWithCovarianceStamped,
    'person_0/walk': JointState,
    'markers': MarkerArray,
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

    def __init__(self, bench: Bench, about: CameraInfo | None = None, **parameters: Any) -> None:
        self.bench = bench
        self.node = bench.add(LocalizerNode, **parameters)
        # What offers the least.
        self.camera = bench.publisher(CameraInfo, 'camera_info', 1, BEST_EFFORT)
        self.depth = bench.publisher(Image, 'depth', 1)
        for topic, kind in OUTPUTS.items():
            bench.record(kind, topic)
        if about is not None:
            self.camera.publish(about)

    def show(
        self,
        index: int,
        track_id: int = 7,
        size: tuple[int, int] = SIZE,
        body: BodyFrame | None = None,
    ) -> dict:
        """Hand over somebody who crosses 4 m away; return what comes."""
        before = {topic: len(self.bench.received[topic]) for topic in OUTPUTS}
        # What was published before comes in.
        self.bench.settle()
        about = header(index)
        # Soles 1 m below the camera, in the middle at the frame 0, 1.2 m/s to the right.
        x = 80 + 40 * 0.04 * index
        body = body or BodyFrame(x, 60 + 40 * GROUND_Y - 34, 68)
        mask = np.zeros(size[::-1], np.uint8)
        mask[35:98, int(x) - 8 : int(x) + 8] = 255
        gait = JointState(header=about, name=['gait_phase', 'view_azimuth'], position=[0.0, 0.0])
        gait.velocity, gait.effort = [2 * np.pi * 0.8, 0.0], [1.0, 0.9]
        corners = body.corners(0.3 * body.height) if track_id else ()
        self.node.receive('person_0/matched_box', box_message(corners, track_id, about))
        self.node.receive('person_0/gait', gait if track_id else JointState(header=about))
        self.node.receive('person_0/mask', image_message(mask, about))
        self.bench.settle()
        return {topic: self.bench.received[topic][count:] for topic, count in before.items()}


def test_somebody_is_where_depth_says_and_walks_as_seen(bench: Bench) -> None:
    places = Places(bench, info())
    for index in range(40):
        places.depth.publish(depth(index))
        new = places.show(index)
        for topic in ('person_0/pose', 'person_0/walk'):
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


def test_the_depth_image_that_is_nearest_in_time_counts(bench: Bench) -> None:
    places = Places(bench, info())
    for index, metres in enumerate((AWAY_M, AWAY_M + 2, AWAY_M + 4)):
        places.depth.publish(depth(index, metres))
    (message,) = places.show(0)['person_0/pose']
    assert message.pose.pose.position.z == pytest.approx(AWAY_M + 0.14, abs=0.03)


def test_nobody_has_no_pose_and_old_markers_go(bench: Bench) -> None:
    places = Places(bench, info())
    new = places.show(0, track_id=0)
    assert (new['person_0/pose'], new['person_0/walk']) == ([], [])
    assert [each.action for each in new['markers'][0].markers] == [Marker.DELETEALL]


def elsewhere(frame_id: str) -> Any:
    made = header(15)
    made.frame_id = frame_id
    return made


NOWHERE = [
    (None, None, None, 'nothing came on /camera_info so far'),
    (info(), None, None, 'nothing came on /depth so far, and where the ground is'),
    (info(width=320, height=240), {}, None, 'of images of 320 x 240, but'),
    (info(distortion_model='equidistant', d=[0.1] * 4), {}, None, "got 'equidistant'"),
    (info(), {'width': 80, 'step': 160}, None, 'image, 160 x 120, got 80'),
    (info(), {'header': elsewhere('depth')}, None, "its frame_id is 'depth', the image's 'head"),
    (info(), {'encoding': 'rgb8'}, None, "16UC1, mono16, 32FC1, got 'rgb8'"),
    (info(), {'header': header(60)}, None, 'the nearest of the last is 0.'),
    (info(), {'data': bytes(2 * SIZE[0] * SIZE[1])}, None, 'no depth on the body'),
    (info(), {}, BodyFrame(1e37, 1e37, 1e38), 'body must be finite, at most'),
]


def test_it_is_said_why_nobody_is_located(bench: Bench, capfd) -> None:
    places = Places(bench)
    for step, (about, changes, body, why) in enumerate(NOWHERE):
        if about is not None:
            places.camera.publish(about)
        if changes is not None:
            places.depth.publish(depth(3 * step, **changes))
        new = places.show(3 * step, body=body)
        assert new['person_0/pose'] == []
        assert len(new['markers'][0].markers) == 1
        trouble = places.node.trouble
        assert trouble.startswith('located: 0 of 1, ')
        assert why in trouble
        located = places.node.status()['located']
        assert why in located
        assert ('a depth image is not used' in located) == (step in range(4, 8))
    # Once in so short a time.
    assert capfd.readouterr().err.count('located: ') == 1
    assert (places.node.statistics.failed, places.node.status()['location errors']) == (0, '0')
    # As soon as all is well, it is said so.
    places.depth.publish(depth(30))
    assert len(places.show(30)['person_0/pose']) == 1
    assert (places.node.trouble, places.node.status()['located']) == ('', '1 of 1')
    # And told again as soon as it is not.
    assert places.show(60)['person_0/pose'] == []
    assert places.node.trouble.startswith('located: 0 of 1')


def test_a_bag_that_loops_gives_the_same_again_and_leaves_nothing(
    bench: Bench,
) -> None:
    places = Places(bench, info())
    about = 'statistics', 'warnings', '_worker', '_info', '_located_text'
    before, rounds = remembered(places.node, *about), []
    for _ in range(2):
        rounds.append([])
        for index in range(0, 40, 3):
            places.depth.publish(depth(index))
            rounds[-1].append(places.show(index))
    assert rounds[0] == rounds[1]
    assert 'speed' in rounds[0][-1]['person_0/walk'][0].name
    places.node.trigger_deactivate()
    places.node.trigger_activate()
    assert differences(before, remembered(places.node, *about)) == []


def test_a_rectified_image_has_the_camera_of_p(bench: Bench) -> None:
    p = [FOCAL, 0.0, 79.5, 0.0, 0.0, FOCAL, 59.5, 0.0, 0.0, 0.0, 1.0, 0.0]
    given = info(focal=1.0, p=p, distortion_model='equidistant', d=[0.1] * 4)
    places = Places(bench, given, rectified=True, **{'localization.camera_height': GROUND_Y})
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


@pytest.mark.parametrize('late', [True, False])
def test_tf_says_where_the_ground_is(bench: Bench, monkeypatch, capfd, late: bool) -> None:
    def lookup(target: str, source: str, when: Any) -> Any:
        assert (target, source) == ('odom', 'head_camera')
        if late and when.nanoseconds:
            raise UnknownError('too new')
        # The camera has risen since the image, if that is known.
        height = GROUND_Y if late or when.nanoseconds else 2 * GROUND_Y
        place = SimpleNamespace(x=5.0, y=6.0, z=height)
        turn = SimpleNamespace(x=-0.5, y=0.5, z=-0.5, w=0.5)
        return SimpleNamespace(transform=SimpleNamespace(translation=place, rotation=turn))

    events = tf2(monkeypatch, lookup)
    places = Places(bench, info(), ground_frame='odom')
    (pose,) = places.show(0)['person_0/pose']
    at = pose.pose.pose.position
    # In the frame of the camera, wherever that is.
    assert (at.x, at.y, at.z) == pytest.approx((0.0, GROUND_Y, AWAY_M), abs=0.02)
    places.node.trigger_deactivate()
    assert events == ['closed']
    assert 'located: ' not in capfd.readouterr().err


@pytest.mark.parametrize(
    ('there', 'said'),
    [
        (True, "tf has no transform from 'head_camera' to 'odom': odom does not exist"),
        (False, 'ground_frame needs the Python package tf2_ros'),
    ],
)
def test_a_way_that_is_not_known_is_said(
    bench: Bench, monkeypatch, capfd, there: bool, said: str
) -> None:
    def lookup(*_: Any) -> Any:
        raise UnknownError('odom does not exist')

    tf2(monkeypatch, lookup)
    if not there:
        monkeypatch.setitem(sys.modules, 'tf2_ros', None)
    places = Places(bench, info(), ground_frame='odom')
    new = places.show(0)
    assert (len(new['markers']), new['person_0/pose']) == (1, [])
    assert said in capfd.readouterr().err
