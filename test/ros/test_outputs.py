# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is published, in which order, and what is not because nobody listens."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from std_msgs.msg import Header

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
from gait_segmentation.ros.messages import (
    Outputs,
    mask_topics,
    match_topics,
    picture_topics,
    seen,
    track_topics,
)
from gait_segmentation.segmentation import PeopleMasks

SLOTS = 2
HEADER = Header(frame_id='camera')
GREY = np.full((6, 8), 9, np.uint8)


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


def _tracks() -> list[TrackResult]:
    return [TrackResult(5, k, Box(1, 2, 3, 4), GREY, 0.5) for k in (1, 2)]


def _matches() -> list[MatchResult]:
    body = BodyFrame(4, 3, 5)
    return [MatchResult(5, k, body, None, 0, 0, 0.1, 1.0, 0.0, 0.9, 0.8, GREY) for k in (1, 2)]


def _masks() -> PeopleMasks:
    return PeopleMasks(tuple(SegmentationResult(5, k, GREY, '') for k in (1, 2)), GREY, GREY)


def test_only_what_is_heard_is_published() -> None:
    node: Any = _Node('person_1/likelihood')
    Outputs(node, track_topics(SLOTS)).publish(_tracks(), HEADER)
    assert node.topics == ['person_1/likelihood']
    node = _Node('person_0/gait', 'person_1/refined_box')
    Outputs(node, match_topics(SLOTS)).publish(_matches(), HEADER)
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


def test_compressed_images_are_made_for_those_who_listen_alone() -> None:
    node: Any = _Node('mask/compressed')
    outputs = Outputs(node, mask_topics(SLOTS))
    outputs.publish(_masks(), HEADER)
    outputs.blank((6, 8), HEADER)
    outputs.blank((0, 0), HEADER)
    assert node.topics == ['mask/compressed'] * 3
    mask, black, empty = (message for _, message in node.published)
    assert (mask.format, mask.header) == ('mono8; png compressed ', HEADER)
    np.testing.assert_array_equal(_decoded(mask), GREY)
    np.testing.assert_array_equal(_decoded(black), np.zeros((6, 8)))
    assert len(empty.data) == 0


@pytest.mark.parametrize('heard', ['debug_image', 'debug_image/compressed'])
def test_a_picture_goes_out_as_it_is_listened_to(heard: str) -> None:
    node: Any = _Node(heard)
    outputs = Outputs(node, picture_topics())
    picture = np.full((16, 16, 3), (10, 120, 200), np.uint8)
    outputs.publish_made(HEADER, lambda: picture)
    ((topic, message),) = node.published
    assert topic == heard
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
    first, second = _matches()
    (person,) = seen([first, replace(second, body=None)], [GREY, GREY], [None, None])[0]
    assert (person.match.track_id, person.box) == (1, Box(0, 0, 8, 6))
