# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What to say where nothing comes: who should publish, and where there are images."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.node import Node


_RAW, _COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'
_SUFFIX = '/compressed'
_OWN = ('gait_matcher', 'gait_pipeline', 'gait_segmenter', 'gait_tracker')
"""Nodes whose images are no camera's."""

_MOST = 4
"""Topics that are named."""


def unpublished(node: Node, topics: Iterable[str], by: str) -> str:
    """
    Say which topics nobody publishes, empty if all are.

    :param by: the node that usually does.
    """
    # To count publishers does not remap.
    resolved = [node.resolve_topic_name(topic) for topic in topics]
    names = [name for name in resolved if not node.count_publishers(name)]
    if not names:
        return ''
    return f'nothing to do: nobody publishes {_listed(names)}; is {by} running and active?'


def nothing_from(by: str) -> str:
    """Say that a node that publishes its topics says nothing."""
    return f'nothing to do: nothing comes from {by}; is it active and enabled, and has it images?'


def no_images(node: Node, topic: str) -> str:
    """
    Say why there are no images on a topic, and where there are some.

    :param topic: with ``/compressed`` at the end if they are to be compressed.
    """
    name = node.resolve_topic_name(topic)
    compressed = topic.endswith(_SUFFIX)
    wanted, other = (_COMPRESSED, _RAW) if compressed else (_RAW, _COMPRESSED)
    kinds = {each.topic_type for each in node.get_publishers_info_by_topic(name)}
    if wanted in kinds:
        return f'no images: {name} has a publisher, but nothing comes from it'
    if kinds:
        return f'no images: what is published on {name} is {_listed(kinds)}, not {wanted}'
    sibling = name.removesuffix(_SUFFIX) if compressed else name + _SUFFIX
    if _from_cameras(node, sibling, other):
        transport = 'raw' if compressed else 'compressed'
        return (
            f'no images: nobody publishes {name}, but {sibling} is: set image_transport to '
            f'{transport}'
        )
    found = [
        each
        for each, types in node.get_topic_names_and_types()
        if wanted in types and _from_cameras(node, each, wanted)
    ]
    text = f'no images: nobody publishes {name}'
    if not found:
        return f'{text}; start the camera, or remap image to its topic'
    return f'{text}, but there are images on {_listed(found)}: remap image (image:=TOPIC)'


def _from_cameras(node: Node, name: str, kind: str) -> bool:
    """Return whether somebody else than this package publishes messages of a kind."""
    return any(
        each.topic_type == kind and each.node_name not in _OWN
        for each in node.get_publishers_info_by_topic(name)
    )


def _listed(names: Iterable[str]) -> str:
    listed = sorted(names)
    more = len(listed) - _MOST
    return ', '.join(listed[:_MOST]) + (f' and {more} more' if more > 0 else '')
