# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is recorded of the nodes' messages, and when the recording ends."""

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

import rclpy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.ros.messages import box_message, image_message
from gait_tools.demo import nodes
from gait_tools.demo.nodes import NODES
from gait_tools.demo.recording import Recording

# rclpy loads deprecated modules of Python with its first publisher.
pytestmark = pytest.mark.filterwarnings('ignore::DeprecationWarning')

BOX = Box(1, 2, 3, 4)
TOPICS = [
    'labels',
    *(f'person_{k}/{name}' for k in range(2) for name in ('box', 'matched_box', 'gait')),
]


@pytest.fixture
def recording(monkeypatch: pytest.MonkeyPatch) -> Iterator[Recording]:
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    rclpy.init(args=[])
    made = Recording(2)
    yield made
    made.close()
    rclpy.try_shutdown()


def take(recording: Recording, topic: str, second: int) -> None:
    """Hand a message to the recording in which slot 1 is seen, as if it had come."""
    header = Header()
    header.stamp.sec = second
    somebody = topic.startswith('person_1')
    if topic == 'labels':
        labels = np.zeros((4, 6), np.uint8)
        labels[2:, 1:4] = 2
        message = image_message(labels, header)
    elif topic.endswith('gait'):
        message = JointState(header=header)
        if somebody:
            message.name, message.position = ['gait_phase', 'view_azimuth'], [np.pi, 0.5]
    else:
        message = box_message(BOX.corners() if somebody else (), 7 * somebody, header)
    with recording.lock:
        recording.heard(topic, second * 10**9, serialize_message(message))


def test_a_result_is_what_the_messages_say(recording: Recording) -> None:
    for topic in TOPICS:
        take(recording, topic, 5)
    recording.published = {3: 5 * 10**9, 4: 6 * 10**9}
    take(recording, 'person_1/box', 6)
    assert recording.answered() == [3]
    result = recording.result(3)
    nobody, person = result.people
    assert (nobody.track.box, nobody.match.body) == (None, None)
    assert (person.track.box, person.track.track_id) == (BOX, 7)
    assert (person.match.phase, person.match.azimuth) == pytest.approx((0.5, 0.5))
    assert person.match.body == BodyFrame(2.5, 4.0, 4.0)
    assert np.argwhere(result.mask == 255).tolist() == np.argwhere(result.labels == 2).tolist()
    assert (person.segmentation.mask == result.mask).all()
    assert not nobody.segmentation.mask.any()


def test_nodes_are_connected_when_all_of_them_say_so(recording: Recording) -> None:
    subscribers = {
        f'subscribers of /person_{k}/{name}': n
        for k in range(2)
        for name, n in {**nodes._LINKS, 'box': 2, 'matched_box': 3, 'gait': 2}.items()
    }
    subscribers['subscribers of /labels'] = 1

    def say(name: str, **more: object) -> None:
        values = {'state': 'active', **more}
        recording.status[name] = {key: str(value) for key, value in values.items()}

    say(NODES[0], state='inactive', **subscribers)
    for name in NODES[1:]:
        say(name, dropped=0)
    assert not recording.connected(NODES, 2)
    say(NODES[0], dropped=3, **subscribers | {'subscribers of /labels': 0})
    assert not recording.connected(NODES, 2)
    say(NODES[0], dropped=3, **subscribers)
    assert recording.connected(NODES, 2)
    assert recording.dropped() == {'gait_tracker': 3}
