# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings that do not flood the log, of frames, and of nothing that comes."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from gait_segmentation.streams.join import ExactJoin

if TYPE_CHECKING:
    from rclpy.node import Node

__all__ = ['Silence', 'Warnings', 'no_images', 'nothing_from', 'unpublished']

_EVERY_S = 5.0
_PATIENCE_S = 10.0
_RAW, _COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'
_SUFFIX = '/compressed'
_OWN = ('gait_matcher', 'gait_pipeline', 'gait_segmenter', 'gait_tracker')
"""Nodes whose images are no camera's."""

_MOST = 4
"""Topics that are named."""


class Warnings:
    """
    The warnings of a node, of which those of one key are logged at most every 5 seconds.

    Frames that nothing could be said of meanwhile are counted in when something is said again.
    """

    def __init__(
        self, log: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Begin with nothing said; ``log`` takes texts, ``clock`` is steady and in seconds."""
        self._log = log
        self._clock = clock
        self._said_s: dict[str, float] = {}
        self._untold: Counter[str] = Counter()

    @property
    def keys(self) -> set[str]:
        """Return the keys of which something was said."""
        return set(self._said_s)

    def warn(self, key: str, text: str) -> bool:
        """Log a warning unless one of its key was logged just before; return whether it was."""
        now_s = self._clock()
        if now_s - self._said_s.get(key, -_EVERY_S) < _EVERY_S:
            return False
        self._said_s[key] = now_s
        self._log(text)
        return True

    def warn_of(self, frames: int, text: str) -> None:
        """
        Log a warning about some frames.

        :param text: the key as well; ``{}`` stands for these frames and those not told of before.
        """
        self._untold[text] += frames
        count = self._untold[text]
        if self.warn(text, text.format(f'{count} frame{"s" * (count != 1)}')):
            del self._untold[text]

    def warn_of_missed(self, join: ExactJoin, remedy: str = '') -> None:
        """
        Log warnings about frames of which not all parts have come.

        :param remedy: what gives more room to those that wait, if anything does.
        """
        skipped = (
            '{} said nothing of {{}}, so there is no result: it skipped them (its log says why), '
            'is disabled, or was not there'
        )
        missed = (
            '{} did not come for {{}}: its publisher left them out, or they were lost on the way'
        )
        late = (
            '{} had not come for {{}} when there was no room for more than '
            f'{join.capacity} that wait' + (f': {remedy}' if remedy else '')
        )
        for text, counts in ((skipped, join.skipped), (missed, join.missed), (late, join.late)):
            for who, count in counts.items():
                self.warn_of(count, text.format(who))


class Silence:
    """Decides when to say that nothing comes: once, and again when it is for another reason."""

    def __init__(self, patience_s: float = _PATIENCE_S) -> None:
        """Wait ``patience_s`` before anything is said, and between."""
        self._patience_s = patience_s
        self._since_s: float | None = None
        self._said = ''

    def broken(self) -> None:
        """Note that something has come, or that nothing is expected."""
        self._since_s = None
        self._said = ''

    def to_say(self, now_s: float, why: Callable[[], str]) -> str:
        """
        Return what is to be said now, empty if nothing is.

        :param now_s: seconds of a steady clock; to be called about once a second.
        :param why: says what is missing, empty if that is somebody else's to say.
        """
        if self._since_s is None:
            self._since_s = now_s
        if now_s - self._since_s < self._patience_s:
            return ''
        self._since_s = now_s
        text = why()
        if text == self._said:
            return ''
        self._said = text
        return text


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
