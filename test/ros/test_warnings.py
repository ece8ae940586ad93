# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace

import pytest

from gait_segmentation.ros.warnings import Silence, Warnings, no_images, unpublished
from gait_segmentation.streams.join import ExactJoin


class Log:
    """Warnings at given times, and what was logged."""

    def __init__(self, times: Iterable[float]) -> None:
        self.said: list[str] = []
        clock = iter(times)
        self.warnings = Warnings(self.said.append, lambda: next(clock))


def test_warnings_of_one_key_are_at_least_5_seconds_apart() -> None:
    log = Log((0.1, 1.0, 2.0, 5.0, 5.2, 10.1, 10.3))
    texts = [('a', 'first'), ('b', 'other'), *(('a', text) for text in ('2', '3', '4', '5', '6'))]
    assert [log.warnings.warn(*each) for each in texts] == [True, True, *[False] * 2, True, False,
                                                            True]  # fmt: skip
    assert log.said == ['first', 'other', '4', '6']
    assert log.warnings.keys == {'a', 'b'}


def test_frames_that_were_not_told_of_are_told_of_with_the_next() -> None:
    log = Log((0.0, 1.0, 2.0, 6.0, 12.0))
    for text in ('a {}', 'a {}', 'b {}', 'a {}', 'a {}'):
        log.warnings.warn_of({'a {}': 3, 'b {}': 1}[text], text)
    assert log.said == ['a 3 frames', 'b 1 frame', 'a 6 frames', 'a 3 frames']


@pytest.mark.parametrize(
    ('remedy', 'end'),
    [
        ('', 'when there was no room for more than 7 that wait'),
        ('buy more', 'when there was no room for more than 7 that wait: buy more'),
    ],
)
def test_it_is_told_who_is_to_blame_for_frames_that_are_not_complete(
    remedy: str, end: str
) -> None:
    join = ExactJoin({'camera': ['image'], 'tracker': ['box']}, 7)
    join.skipped['tracker'] += 1
    join.missed['box'] += 2
    join.late['box'] += 3
    log = Log(range(3))
    log.warnings.warn_of_missed(join, remedy)
    skipped, missed, late = log.said
    assert skipped.startswith('tracker said nothing of 1 frame, ')
    assert missed.startswith('box did not come for 2 frames: ')
    assert late == f'box had not come for 3 frames {end}'


RAW, COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'


class Graph:
    """What a node sees of the graph: the publishers of each topic."""

    def __init__(self, **publishers: tuple[str, str]) -> None:
        self._publishers = {
            '/' + name.replace('__', '/'): [SimpleNamespace(node_name=node, topic_type=kind)]
            for name, (node, kind) in publishers.items()
        }

    def resolve_topic_name(self, name: str) -> str:
        return {'door/box': '/person_0/box'}.get(name, f'/{name}')

    def count_publishers(self, name: str) -> int:
        return len(self.get_publishers_info_by_topic(name))

    def get_publishers_info_by_topic(self, name: str) -> list[SimpleNamespace]:
        return self._publishers.get(name, [])

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [(n, [p.topic_type for p in found]) for n, found in self._publishers.items()]


def test_it_is_said_once_after_a_while_and_again_when_it_changes() -> None:
    silence = Silence(patience_s=3.0)
    said = [silence.to_say(now, lambda now=now: 'no' if now < 8 else 'yes') for now in range(14)]
    assert said == ['', '', '', 'no', *[''] * 5, 'yes', *[''] * 4]
    silence.broken()
    assert [silence.to_say(now, lambda: 'yes') for now in (20, 22, 23)] == ['', '', 'yes']


@pytest.mark.parametrize(
    ('graph', 'topic', 'text'),
    [
        (Graph(), 'image', 'nobody publishes /image; start the camera, or remap image to its'),
        (
            Graph(
                cam__b=('v4l2', RAW), cam__a=('v4l2', RAW), mask=('gait_segmenter', RAW),
                depth=('v4l2', COMPRESSED),
            ),
            'image',
            'nobody publishes /image, but there are images on /cam/a, /cam/b: remap image (',
        ),
        (
            Graph(image__compressed=('v4l2', COMPRESSED), a=('v4l2', RAW)),
            'image',
            'but /image/compressed is: set image_transport to compressed',
        ),
        (
            Graph(image=('v4l2', RAW)),
            'image/compressed',
            'nobody publishes /image/compressed, but /image is: set image_transport to raw',
        ),
        (Graph(image=('v4l2', RAW)), 'image', '/image has a publisher, but nothing comes from it'),
        (
            Graph(image=('v4l2', COMPRESSED)),
            'image',
            f'what is published on /image is {COMPRESSED}, not {RAW}',
        ),
        (
            Graph(**{f'c{k}': ('v4l2', RAW) for k in range(6)}),
            'image',
            'there are images on /c0, /c1, /c2, /c3 and 2 more:',
        ),
    ],
)  # fmt: skip
def test_without_images_it_is_said_where_there_are_some(graph, topic, text) -> None:
    said = no_images(graph, topic)
    assert said.startswith('no images: ')
    assert text in said


def test_topics_that_nobody_publishes_are_named_with_who_should() -> None:
    graph = Graph(person_0__box=('gait_tracker', 'x'))
    topics = ('person_0/box', 'person_0/likelihood')
    assert unpublished(graph, topics, 'gait_tracker') == (
        'nothing to do: nobody publishes /person_0/likelihood; is gait_tracker running and active?'
    )
    assert unpublished(graph, topics[:1], 'gait_tracker') == ''
    assert unpublished(graph, ['door/box'], 'gait_tracker') == ''
