# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonInstance, PolygonInstanceStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CompressedImage, Image, RegionOfInterest
from std_srvs.srv import SetBool, Trigger

from gait_segmentation.detector import scheduler
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import Networks
from gait_segmentation.encodings import read_bgr, read_mono8
from gait_segmentation.errors import DetectorError
from gait_segmentation.geometry import Box
from gait_segmentation.nodes import camera_node
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.ros import messages as outputs
from gait_segmentation.ros.diagnostics import missing_input
from gait_segmentation.ros.messages import box_message, image_message
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.streams.fields import stamp_of
from test.nodes.bench import Bench, frame, header

BOX = [30.0, 20.0, 24.0, 80.0]
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def boxes(bench: Bench) -> list[int]:
    return [len(m.polygon.polygon.points) for m in bench.received['person_0/box']]


def test_of_16_bits_as_many_are_used_as_the_camera_has(bench: Bench, monkeypatch) -> None:
    node = bench.add(TrackerNode, sample_bits=12)
    bench.record_outputs('person_0/box')
    seen: list[np.ndarray] = []
    monkeypatch.setattr(node.intake, 'take', lambda image, stamp: seen.append(image))
    message = Image(header=header(0), height=120, width=160, encoding='mono16', step=320)
    message.data = np.full((120, 160), 2000, np.uint16).tobytes()
    bench.publisher(Image, 'image', 1).publish(message)
    bench.until(lambda: bool(seen), 'the image')
    assert (seen[0] == 2000 >> 4).all()


def feedback(bench: Bench) -> tuple[Any, ...]:
    """Return a tracker that has seen a frame, its camera, and the publishers of the feedback."""
    node = bench.add(TrackerNode, initial_box=BOX)
    bench.record_outputs('person_0/box', 'person_0/likelihood')
    camera = bench.publisher(Image, 'image', 1)
    masks = bench.publisher(Image, 'person_0/mask', 1)
    priors = bench.publisher(Image, 'person_0/shape_prior', 1)
    matched = bench.publisher(PolygonInstanceStamped, 'person_0/matched_box', 1)
    bench.feed(camera, [frame(0)])
    return node, camera, masks, priors, matched


def test_feedback_of_one_stamp_is_learnt(bench: Bench, monkeypatch) -> None:
    node, _, masks, priors, matched = feedback(bench)
    learnt = []
    monkeypatch.setattr(node.stage, 'learn', learnt.append)
    mask = np.zeros((120, 160), np.uint8)
    mask[20:100, 30:54] = 255
    likelihood = read_mono8(bench.received['person_0/likelihood'][0])
    corners = ((30, 20), (54, 20), (54, 100), (30, 100))
    matched.publish(box_message(corners, 1, header(0)))
    masks.publish(image_message(mask, header(0)))
    priors.publish(image_message(likelihood, header(1)))
    priors.publish(image_message(likelihood, header(0)))
    # A prior of another stamp makes no feedback; that it came first shows that it was heard.
    bench.until(lambda: bool(learnt), 'feedback')
    ((each,),) = learnt
    assert each.stamp_ns == header(0).stamp.sec * 10**9 + header(0).stamp.nanosec
    assert (each.track_id, each.body.height) == (1, 80)
    np.testing.assert_array_equal(each.mask, mask)


def test_feedback_that_does_not_fit_is_ignored(bench: Bench) -> None:
    node, camera, masks, priors, matched = feedback(bench)
    wrong = np.full((10, 10), 255, np.uint8)
    matched.publish(box_message(((0, 0), (9, 0), (9, 9), (0, 9)), 1, header(0)))
    masks.publish(image_message(wrong, header(0)))
    priors.publish(image_message(wrong, header(0)))
    bench.until(lambda: 'feedback' in node.warnings.said_s, 'the warning')
    bench.feed(camera, [frame(1)])
    assert boxes(bench) == [4, 4]


def test_stamps_that_are_not_positive_are_refused_as_they_are(bench: Bench, capfd) -> None:
    node = bench.add(TrackerNode)
    odd = frame(0)
    odd.header.stamp.sec, odd.header.stamp.nanosec = -2, 500_000_000
    node.receive('image', odd)
    assert 'a message with the stamp -1.5 s is ignored' in capfd.readouterr().err
    assert missing_input(node) == 'what comes has no stamp'
    node.receive('image', frame(0))
    assert missing_input(node) != 'what comes has no stamp'


def test_a_configuration_that_fails_leaves_the_node_unconfigured(
    bench: Bench, monkeypatch, capfd
) -> None:
    node = bench.add(TrackerNode, start=False, bank='/no/such/bank.npz')
    assert not node.start()
    assert node.state == 'unconfigured'
    node = bench.add(TrackerNode, start=False)
    before, build = len(list(node.publishers)), node.build

    def build_and_fail() -> None:
        build()
        assert len(list(node.publishers)) > before
        raise MemoryError('no room')

    with monkeypatch.context() as patch:
        patch.setattr(node, 'build', build_and_fail)
        assert not node.start()
    assert (node.state, len(list(node.publishers))) == ('unconfigured', before)
    assert 'configuring failed: MemoryError: no room' in capfd.readouterr().err
    assert node.start()
    assert node.state == 'active'


def test_services_reset_and_disable(bench: Bench) -> None:
    node = bench.add(TrackerNode, initial_box=BOX)
    bench.record_outputs('person_0/box')
    camera = bench.publisher(Image, 'image', 1)
    bench.feed(camera, [frame(0), frame(1)])
    told = bench.call(SetBool, 'gait_tracker/enable', SetBool.Request(data=False))
    assert (told.success, told.message) == (True, 'disabled: frames are ignored')
    camera.publish(frame(2))
    assert camera.wait_for_all_acked()
    bench.settle()
    told = bench.call(SetBool, 'gait_tracker/enable', SetBool.Request(data=True))
    assert (told.success, told.message) == (True, 'enabled')
    bench.feed(camera, [frame(3)])
    bench.settle()
    answered = [message.header for message in bench.received['person_0/box']]
    assert answered == [header(index) for index in (0, 1, 3)]
    # Who was tracked is forgotten.
    assert boxes(bench)[:2] == [4, 4]
    assert boxes(bench)[-1] == 0
    node.intake.requested.append(Box(*BOX))
    bench.feed(camera, [frame(4)])
    assert boxes(bench)[-1] == 4
    # Nor does a box that waits outlast a reset.
    node.intake.requested.append(Box(*BOX))
    assert bench.call(Trigger, 'gait_tracker/reset', Trigger.Request()).success
    bench.feed(camera, [frame(5)])
    assert boxes(bench)[-1] == 0
    assert node.statistics.dropped == 0


def test_compressed_images_are_tracked_from_the_stamp_of_the_box_on(bench: Bench) -> None:
    start = {'initial_box': BOX, 'initial_box_stamp': stamp_of(header(1))}
    bench.add(TrackerNode, image_transport='compressed', **start)
    bench.record_outputs('person_0/box', 'person_0/likelihood')
    camera = bench.publisher(CompressedImage, 'image/compressed', 1)
    messages = []
    for index in range(2):
        raw = frame(index)
        message = CompressedImage(header=raw.header, format='png')
        message.data.frombytes(cv2.imencode('.png', read_bgr(raw))[1].tobytes())
        messages.append(message)
    broken = CompressedImage(header=header(2), format='jpeg')
    bench.feed(camera, [*messages, broken])
    assert boxes(bench) == [0, 4, 0]
    assert [m.header for m in bench.received['person_0/box']] == [header(i) for i in range(3)]


def test_the_size_is_told_when_it_changes_and_to_those_who_come_later(bench: Bench) -> None:
    bench.add(TrackerNode)
    bench.record_outputs('person_0/box')
    sizes = bench.record(RegionOfInterest, 'image_size', LATCHED)
    camera = bench.publisher(Image, 'image', 1)
    bench.feed(camera, [frame(0), frame(1), frame(2, (200, 140))])
    bench.until(lambda: len(sizes) == 2, 'the sizes')
    assert [(each.width, each.height) for each in sizes] == [(160, 120), (200, 140)]
    later: list[RegionOfInterest] = []
    bench.probe.create_subscription(RegionOfInterest, 'image_size', later.append, LATCHED)
    bench.until(lambda: bool(later), 'the size')
    assert later[0].width == 200


def test_diagnostics_report_frames_and_track(bench: Bench) -> None:
    node = bench.add(TrackerNode, initial_box=BOX)
    bench.record_outputs('person_0/box')
    camera = bench.publisher(Image, 'image', 1)
    reports = bench.record(DiagnosticArray, '/diagnostics')
    bench.feed(camera, [frame(0), frame(1)])
    bench.settle()
    reports.clear()
    bench.until(lambda: bool(reports), 'a report')
    (status,) = reports[-1].status
    values = {each.key: each.value for each in status.values}
    assert status.name == 'gait_tracker'
    assert (values['state'], values['received'], values['processed']) == ('active', '2', '2')
    assert (values['people'], values['kernels ready']) == ('1', 'true')
    assert (values['camera'], status.hardware_id) == ('/image', '/image')
    assert values['track of person_0'].startswith('1 tracked')
    assert values['subscribers of /person_0/box'] == '1'
    bench.probe.create_publisher(PolygonInstanceStamped, 'person_0/box', 10)
    said = '/probe publishes /person_0/box, too'
    bench.until(lambda: reports[-1].status[0].message.startswith(said), 'the warning')
    assert 'twice' in node.warnings.said_s


def test_the_qos_of_endpoints_can_be_overridden(bench: Bench) -> None:
    bench.add(
        TrackerNode,
        **{
            'qos_overrides./person_0/box.publisher.depth': 3,
            'qos_overrides./person_0/box.publisher.reliability': 'best_effort',
            'qos_overrides./image.subscription.depth': 7,
        },
    )
    (node,) = bench.nodes
    by_name = {each.topic_name: each.qos_profile for each in node.outputs}
    assert by_name['/person_0/box'].depth == 3
    assert by_name['/person_0/box'].reliability.name == 'BEST_EFFORT'
    assert by_name['/person_0/likelihood'].reliability.name == 'RELIABLE'
    found = [each for each in node.subscriptions if each.topic_name == '/image']
    assert [each.qos_profile.depth for each in found] == [7]


def test_detections_start_tracks_of_new_people_and_tracks_go_out(
    bench: Bench, monkeypatch
) -> None:
    """With a message type that stands in for vision_msgs, which has no wheel."""
    kind = PolygonInstanceStamped
    types = SimpleNamespace(Detection2DArray=kind)
    for module in (camera_node, outputs):
        monkeypatch.setattr(module, 'detection_types', lambda: types)
    monkeypatch.setattr(camera_node, 'read_detections', lambda message, config: [Box(*BOX)])
    monkeypatch.setattr(
        outputs,
        'tracks_message',
        lambda tracks, header, types: kind(
            header=header, polygon=PolygonInstance(id=sum(t.box is not None for t in tracks))
        ),
    )
    bench.add(TrackerNode)
    bench.record_outputs('person_0/box')
    tracks = bench.record(kind, 'tracks')
    camera = bench.publisher(Image, 'image', 1)
    detector = bench.publisher(kind, 'detections', 1)
    bench.feed(camera, [frame(0)])
    for index in (1, 2):
        detector.publish(kind(header=header(index)))
        assert detector.wait_for_all_acked()
        bench.settle()
        bench.feed(camera, [frame(index)])
    bench.until(lambda: len(tracks) == 3, 'the tracks')
    assert [message.polygon.id for message in tracks] == [0, 1, 1]
    # Somebody who is tracked is not started anew.
    assert [m.polygon.id for m in bench.received['person_0/box']] == [0, 1, 1]


def test_heat_maps_start_tracks(bench: Bench) -> None:
    node = bench.add(TrackerNode)
    bench.record_outputs('person_0/box')
    camera = bench.publisher(Image, 'image', 1)
    maps = bench.publisher(Image, 'heat_map', 1, BEST_EFFORT)
    heat = np.zeros((60, 80), np.uint8)
    heat[10:50, 15:27] = 255
    for index in range(4):
        maps.publish(image_message(heat, header(index)))
        bench.settle()
        bench.feed(camera, [frame(index)])
    assert boxes(bench)[-1] == 4
    assert node.status()['heat map'] == 'in use'
    bench.feed(camera, [frame(60)])
    assert node.status()['heat map'] == 'none'


def test_the_detector_looks_beside_the_frames(bench: Bench, monkeypatch) -> None:
    errors = [DetectorError('no network')]

    def people(image: np.ndarray) -> list[Detection]:
        if errors:
            raise errors.pop()
        figure = Box.around(cv2.inRange(image, (0, 0, 200), (60, 60, 255)))
        return [] if figure is None else [Detection(figure, 0.9)]

    monkeypatch.setattr(scheduler, 'open_networks', lambda *_: Networks(people))
    node = bench.add(TrackerNode, **{'detector.network': 'boxes'})
    bench.record_outputs('person_0/box')
    camera = bench.publisher(Image, 'image', 1)
    for index in range(30):
        bench.feed(camera, [frame(index)])
    assert boxes(bench)[0] == 0
    assert boxes(bench)[-1] == 4
    assert 'detector' in node.warnings.said_s
    assert node.status()['detector'].startswith('sees 1, ')
