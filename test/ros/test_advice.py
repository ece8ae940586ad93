# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from types import SimpleNamespace

import pytest

from gait_segmentation.ros.diagnostics import no_images, unpublished

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
