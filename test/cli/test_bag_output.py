# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from gait_segmentation.cli.bag_output import BagOutput
from gait_segmentation.cli.lockstep import Replayed
from test.cli.results import STEP_NS, replayed

SHAPE = (240, 320)
TOPICS = {
    '/person_0/box': 'geometry_msgs/msg/PolygonInstanceStamped',
    '/person_0/likelihood': 'sensor_msgs/msg/Image',
    '/person_0/matched_box': 'geometry_msgs/msg/PolygonInstanceStamped',
    '/person_0/refined_box': 'geometry_msgs/msg/PolygonInstanceStamped',
    '/person_0/shape_prior': 'sensor_msgs/msg/Image',
    '/person_0/gait': 'sensor_msgs/msg/JointState',
    '/person_0/mask': 'sensor_msgs/msg/Image',
    '/mask': 'sensor_msgs/msg/Image',
    '/labels': 'sensor_msgs/msg/Image',
}


def frame(index: int) -> Replayed:
    mask = np.zeros(SHAPE, np.uint8)
    mask[50:200, 30 + index : 90 + index] = 255
    return replayed(index, [(7, mask, 0.3)])


def contents(path: Path) -> list[tuple[str, int, bytes]]:
    with Reader(path) as reader:
        return [(c.topic, stamp, bytes(data)) for c, stamp, data in reader.messages()]


def test_the_topics_are_those_of_the_nodes(tmp_path: Path) -> None:
    output = BagOutput(tmp_path / 'walk')
    for index in range(5):
        output.add(*frame(index))
    output.close(complete=True)
    assert sorted(p.name for p in (tmp_path / 'walk').iterdir()) == ['metadata.yaml', 'walk.mcap']
    with Reader(tmp_path / 'walk') as reader:
        assert {name: topic.msgtype for name, topic in reader.topics.items()} == {
            **TOPICS,
            '/image_size': 'sensor_msgs/msg/RegionOfInterest',
        }
        counts = {name: topic.msgcount for name, topic in reader.topics.items()}
        assert counts == {**dict.fromkeys(TOPICS, 5), '/image_size': 1}
        stamps = [stamp for _, stamp, _ in reader.messages()]
        assert reader.duration == 4 * STEP_NS + 1
        assert stamps == sorted(stamps)
        store = get_typestore(Stores.ROS2_JAZZY)
        for connection, stamp, data in reader.messages():
            if connection.topic != '/image_size':
                header: Any = store.deserialize_cdr(data, connection.msgtype).header
                assert header.frame_id == 'head_camera'
                assert header.stamp.sec * 10**9 + header.stamp.nanosec == stamp - 1000


@pytest.mark.filterwarnings('ignore::DeprecationWarning')
def test_messages_are_those_of_the_nodes(tmp_path: Path) -> None:
    pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')
    from rclpy.serialization import deserialize_message, serialize_message
    from sensor_msgs.msg import RegionOfInterest
    from std_msgs.msg import Header

    from gait_segmentation.ros.messages import box_message, gait_message, image_message
    from gait_segmentation.streams.fields import matched_corners, refined_corners, track_corners

    output = BagOutput(tmp_path / 'walk')
    one = frame(3)
    output.add(*one)
    output.close(complete=True)
    (person,) = one.result.people
    header = Header(frame_id='head_camera')
    header.stamp.sec, header.stamp.nanosec = divmod(one.frame.header_ns, 10**9)
    expected = {
        '/image_size': RegionOfInterest(height=240, width=320),
        '/person_0/box': box_message(track_corners(person.track), 7, header),
        '/person_0/likelihood': image_message(person.track.likelihood, header),
        '/person_0/matched_box': box_message(matched_corners(person.match), 7, header),
        '/person_0/refined_box': box_message(refined_corners(person.match), 7, header),
        '/person_0/shape_prior': image_message(person.match.shape_prior, header),
        '/person_0/gait': gait_message(person.match, header),
        '/person_0/mask': image_message(person.segmentation.mask, header),
        '/mask': image_message(one.result.mask, header),
        '/labels': image_message(one.result.labels, header),
    }
    found = {topic: data for topic, _, data in contents(tmp_path / 'walk')}
    assert found.keys() == expected.keys()
    for topic, message in expected.items():
        # Not byte by byte: rclpy leaves to chance what lies between aligned fields.
        sent = bytes(serialize_message(message))
        kind = type(message)
        assert deserialize_message(found[topic], kind) == deserialize_message(sent, kind), topic
        assert len(found[topic].rstrip(b'\0')) <= len(sent) <= len(found[topic]) + 8, topic
