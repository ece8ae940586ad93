# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the recorder keeps of a frame, and what it counts."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from gait_segmentation.cli.recorder import Record, Recorder
from gait_segmentation.geometry import Box
from gait_segmentation.ros.messages import box_message, image_message

# rclpy loads deprecated modules of Python with its first publisher.
pytestmark = pytest.mark.filterwarnings('ignore::DeprecationWarning')


def test_labels_are_kept_in_little_memory() -> None:
    labels = np.zeros((480, 640), np.uint8)
    labels[100:300, 200:260] = 1
    labels[120:330, 400:450] = 2
    record = Record()
    record.keep(labels[:, ::-1])
    assert record.packed is not None
    assert len(record.packed[0]) < 10_000
    assert (record.labels == labels[:, ::-1]).all()
    assert (record.mask == 255 * (labels[:, ::-1] > 0)).all()
    # A picture is drawn on it.
    record.labels[0, 0] = 1
    assert record.labels[0, 0] == 0


@pytest.fixture
def recorder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Recorder]:
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    rclpy.init(args=[])
    made = Recorder(2)
    yield made
    made.close()
    rclpy.try_shutdown()


def take(recorder: Recorder, topic: str, second: int) -> None:
    """Hand a message of an empty frame to the recorder, as if it had come."""
    header = Header()
    header.stamp.sec = second
    if topic.endswith(('mask', 'likelihood', 'shape_prior')):
        recorder._receive(topic, struct.pack('=4xiI', second, 0))
    elif topic == 'labels':
        recorder._receive(topic, image_message(np.zeros((4, 6), np.uint8), header))
    elif topic.endswith('gait'):
        recorder._receive(topic, JointState(header=header))
    else:
        recorder._receive(topic, box_message(Box(1, 2, 3, 4).corners(), 7, header))


def test_a_frame_is_complete_once_and_when_all_has_come(recorder: Recorder) -> None:
    for count, topic in enumerate(recorder.topics):
        assert (recorder.complete(), recorder.messages()) == (0, count)
        take(recorder, topic, 5)
    assert recorder.complete() == 1
    for topic in recorder.topics[:3]:
        take(recorder, topic, 5)
        take(recorder, topic, 6)
    assert (recorder.complete(), recorder.messages()) == (1, len(recorder.topics) + 6)
    assert recorder.received(recorder.topics[0]) == 3
    record = recorder.records[5 * 10**9]
    assert (record.person(1).box, record.person(1).track_id) == (Box(1, 2, 3, 4), 7)
    # A gait without names is nobody's.
    assert np.isnan(record.person(1).phase)
    assert not record.mask.any()


def test_nodes_are_connected_when_all_of_them_say_so(recorder: Recorder) -> None:
    subscribers = {f'subscribers of /{topic}': n for topic, n in recorder._connected.items()}

    def say(name: str, **more: object) -> None:
        values = {'state': 'active', **more}
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        status = DiagnosticStatus(name=name, values=pairs)
        recorder._diagnose(DiagnosticArray(status=[status]))

    say('gait_tracker', state='inactive', **subscribers)
    say('gait_matcher', skipped=0)
    assert recorder.active() == {'gait_matcher'}
    assert not recorder.connected('gait_tracker', 'gait_matcher')
    say('gait_tracker', skipped=3, **subscribers | {'subscribers of /labels': 0})
    assert not recorder.connected('gait_tracker', 'gait_matcher')
    say('gait_tracker', skipped=3, **subscribers)
    assert recorder.connected('gait_tracker', 'gait_matcher')
    assert recorder.dropped() == {'gait_tracker': 3}
