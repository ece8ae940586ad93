# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The images of a rosbag2 (sqlite3 or MCAP) or of a ROS 1 bag."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.encodings import claimed_shape, read_image
from gait_segmentation.errors import InputError, SequenceError, not_installed
from gait_segmentation.inputs.source import DEFAULT_FPS, DamagedError, Entry, ImageSource

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import TopicInfo

_STORAGE = ('.mcap', '.db3')
_IMAGE_TYPES = ('sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage')
_MEND = 'mcap recover FILE, rosbag reindex FILE or ros2 bag reindex FOLDER mends what was cut off'
_NAMELESS = re.compile(rb"""storage_identifier: *(''|"")? *$""", re.MULTILINE)
_RATE_FRAMES = 60
"""Stamps that the rate is found from."""


def is_bag(path: Path) -> bool:
    """Return whether a path seems to be a bag: by its suffix, or by what the folder holds."""
    if not path.is_dir():
        return path.suffix in ('.bag', *_STORAGE)
    about = path / 'metadata.yaml'
    # Folders of images may have metadata of their own.
    return bool(_storage_files(path)) or (
        about.is_file() and b'rosbag2_bagfile_information' in about.read_bytes()
    )


def _storage_files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    return [each for each in path.iterdir() if each.name.removesuffix('.zstd').endswith(_STORAGE)]


class BagSource(ImageSource):
    """
    The images on one topic of a bag, with the stamps of their headers.

    One whose recording was cut off, so that index, metadata or the log of SQLite are missing, is
    to be mended first.
    """

    def __init__(
        self,
        path: Path,
        *,
        topic: str = '',
        read: Callable[[Any, int, int], NDArray[np.uint8]] = read_image,
        **wanted: Any,
    ) -> None:
        """
        Open a bag.

        :param topic: of the images; empty: the one that holds images.
        :param read: decodes a message, given the pixels it may have and the bits of those of 16.
        :param wanted: ``width``, ``start`` and ``count``, see :func:`open_input`.
        :raises SequenceError: if the bag cannot be read, the topic is not there or not clear, or
            what reads bags is not installed.
        """
        if wanted.get('rate'):
            raise SequenceError(f'{path} is a bag, and its images have stamps: leave out --rate')
        try:
            # Of the extra ``tools``.
            import rosbags  # noqa: F401
        except ModuleNotFoundError as error:
            raise SequenceError(f'{path} is a bag: {not_installed(str(error.name))}') from error
        self.topic, self._read = topic, read
        super().__init__(path, **wanted)

    def open(self) -> int:
        """Find the topic."""
        for file in _storage_files(self.path):
            log = file.with_name(f'{file.name}-wal')
            if log.exists() and log.stat().st_size:
                raise SequenceError(
                    f'{file}: its recorder was killed, and its last messages are only in '
                    f"{log.name}; put them in: sqlite3 FILE 'PRAGMA wal_checkpoint(TRUNCATE)'"
                )
        topics = self._topics()
        self.topic = _chosen(self.path, topics, self.topic)
        return topics[self.topic].msgcount

    def rate(self) -> float:
        """Return the rate by the median interval of the first stamps."""
        stamps = []
        try:
            for entry in islice(self.entries(), _RATE_FRAMES):
                stamps.append(entry.header_ns or entry.recorded_ns)
        except DamagedError:
            pass
        steps = np.diff(stamps)
        steps = steps[steps > 0]
        return float(1e9 / np.median(steps)) if steps.size else DEFAULT_FPS

    def entries(self) -> Iterator[Entry]:
        """Yield all images of the topic."""
        read = 0
        with self._reader() as reader:
            wanted = [each for each in reader.connections if each.topic == self.topic]
            expected = sum(each.msgcount for each in wanted)
            messages = iter(reader.messages(connections=wanted))
            problem: Exception | None = None
            while True:
                try:
                    connection, recorded_ns, data = next(messages)
                except StopIteration:
                    break
                except Exception as error:
                    # rosbags and SQLite raise whatever the damage made of it.
                    problem = error
                    break
                read += 1
                yield self._entry(reader, connection.msgtype, recorded_ns, data)
        # Damaged places inside of chunks are skipped by rosbags.
        if problem is not None or read < expected:
            why = '' if problem is None else f' ({problem!r})'
            raise DamagedError(
                f'{self.path} is damaged: {read} of {expected} images on {self.topic} can be '
                f'read{why}; {_MEND}'
            ) from problem

    def _entry(self, reader: AnyReader, kind: str, recorded_ns: int, data: bytes) -> Entry:
        try:
            message: Any = reader.deserialize(data, kind)
        except Exception as problem:
            # rosbags raises whatever the data made of it.
            error = InputError(f'the message cannot be read ({problem!r})')
            return Entry(0, recorded_ns, '', partial(_fail, error))
        stamp = message.header.stamp
        header_ns = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
        decode = partial(self._read, message, self._max_pixels, self._sample_bits)
        shape = claimed_shape(message) or (0, 0)
        return Entry(header_ns, recorded_ns, message.header.frame_id, decode, shape)

    @contextmanager
    def _reader(self) -> Iterator[AnyReader]:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        # Old recordings of ROS 2 do not say what their messages are.
        types = get_typestore(Stores.ROS2_JAZZY)
        with AnyReader(self._readable(), default_typestore=types) as reader:
            yield reader

    def _readable(self) -> list[Path]:
        """Return the bag, or its files if its metadata does not say what they are."""
        about = self.path / 'metadata.yaml'
        # So ros2 bag reindex of Humble leaves it.
        if about.is_file() and _NAMELESS.search(about.read_bytes()):
            return sorted(_storage_files(self.path))
        return [self.path]

    def _topics(self) -> dict[str, TopicInfo]:
        try:
            with self._reader() as reader:
                return reader.topics
        except Exception as error:
            # rosbags and SQLite raise whatever the damage made of it.
            why = f'{_MEND} (rosbags says: {str(error) or repr(error)})'
            if any(
                each.suffix == '.mcap' and _is_ros1(each) for each in _storage_files(self.path)
            ):
                why = 'MCAP with messages of ROS 1, of which only .bag is read'
            elif self.path.is_dir() and not (self.path / 'metadata.yaml').is_file():
                why = 'its metadata.yaml is missing: ros2 bag reindex FOLDER makes it'
            raise SequenceError(f'{self.path} cannot be read as a bag: {why}') from error


def _is_ros1(path: Path) -> bool:
    """Tell whether a file of MCAP says at its beginning that it is of ROS 1."""
    with path.open('rb') as file:
        return b'ros1' in file.read(64)


def _fail(error: InputError) -> NDArray[np.uint8]:
    raise error


def _chosen(path: Path, topics: dict[str, TopicInfo], wanted: str) -> str:
    """Return the topic to read; SequenceError with a list of them if it is not clear."""
    images = {name: topic for name, topic in topics.items() if topic.msgtype in _IMAGE_TYPES}
    if wanted:
        names = [name for name in (wanted, f'/{wanted}') if name in topics]
        if names and names[0] in images:
            return names[0]
        what = f'is {_described(topics[names[0]])}' if names else 'is not there'
        raise SequenceError(
            f'{path}: topic {wanted} {what}; topics with images: {_topic_list(images or topics)}'
        )
    filled = [name for name, topic in images.items() if topic.msgcount]
    if len(filled) == 1:
        return filled[0]
    if not filled:
        raise SequenceError(
            f'{path} has no images (sensor_msgs/Image or CompressedImage); its topics: '
            f'{_topic_list(topics)}'
        )
    raise SequenceError(
        f'{path} has {len(filled)} topics with images, choose one with --topic (topic:= of a '
        f'launch file): {_topic_list({name: images[name] for name in filled})}'
    )


def _topic_list(topics: dict[str, TopicInfo]) -> str:
    return ', '.join(f'{name} ({_described(topics[name])})' for name in sorted(topics)) or 'none'


def _described(topic: TopicInfo) -> str:
    return f'{topic.msgtype}, {topic.msgcount} messages'
