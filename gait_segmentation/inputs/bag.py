# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The images of a rosbag2 (sqlite3 or MCAP) or of a ROS 1 bag."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError, SequenceError, not_installed
from gait_segmentation.inputs.encodings import SampleBits, claimed_shape, read_image
from gait_segmentation.inputs.source import (
    DEFAULT_FPS,
    DamagedError,
    Entry,
    ImageSource,
    check_file,
)

_STORAGE = ('.mcap', '.db3')
_REMEDIES = {
    '': 'ros2 bag reindex FOLDER',
    '.bag': 'rosbag reindex FILE',
    '.db3': 'sqlite3 FILE .recover | sqlite3 NEW, and ros2 bag reindex FOLDER',
    '.zstd': 'zstd -d FILE',
    '.mcap': 'mcap recover FILE -o NEW, and ros2 bag reindex FOLDER',
}
"""What mends a bag, by the ending of its files; of a folder whose metadata are missing first."""

_ZSTD = b'\x28\xb5\x2f\xfd'
"""How data that zstd has packed begins, and no message of ROS 2 does."""

_IMAGE = 'sensor_msgs/msg/Image'
_COMPRESSED = 'sensor_msgs/msg/CompressedImage'
_RATE_FRAMES = 60
"""Stamps that the rate is found from."""


def is_bag(path: Path) -> bool:
    """Return whether a path looks like a bag: by its suffix, or by what the folder holds."""
    if path.is_dir():
        return (path / 'metadata.yaml').is_file() or bool(_storage_files(path))
    return path.suffix == '.bag' or _is_storage(path)


def _is_storage(path: Path) -> bool:
    """Return whether a path looks like a file of a rosbag2, which may be packed as a whole."""
    return path.name.removesuffix('.zstd').endswith(_STORAGE)


def _storage_files(path: Path) -> list[Path]:
    """Return the files of a bag in the order they were written."""
    if not path.is_dir():
        return [path]
    # NAME_2 comes before NAME_10.
    files = {p.name.removesuffix('.zstd'): p for p in path.iterdir() if _is_storage(p)}
    return [files[name] for name in sorted(files, key=lambda name: (len(name), name))]


class _UriPath(type(Path())):  # type: ignore[misc]
    """A path that rosbags may format into the URI by which SQLite opens a file."""

    def __format__(self, _: str) -> str:
        return quote(str(self))


class Topic(NamedTuple):
    """A topic of a bag, its type and the number of its messages, None if unknown."""

    kind: str
    messages: int | None


class BagSource(ImageSource):
    """
    The images on one topic of a bag, with the stamps of their headers.

    One whose recording was cut off, so that index or metadata are missing, is to be mended first.
    """

    read = staticmethod(read_image)
    """Decodes a message, given the pixels it may have and the bits of those before."""

    def __init__(self, path: Path, *, topic: str = '', **wanted: Any) -> None:
        """
        Open a bag.

        :param topic: of the images; empty: the one that holds images.
        :param wanted: ``width``, ``start`` and ``count``, see :func:`open_input`.
        :raises SequenceError: if the bag cannot be read, the topic is not there or not clear, or
            what reads bags is not installed.
        """
        if wanted.get('rate'):
            raise SequenceError(f'{path} is a bag, and its images have stamps: leave out --rate')
        try:
            # Of the extra ``tools``.
            import mcap  # noqa: F401
            import rosbags  # noqa: F401
        except ModuleNotFoundError as error:
            raise SequenceError(f'{path} is a bag: {not_installed(str(error.name))}') from error
        self.topic = topic
        super().__init__(path, **wanted)

    def open(self) -> int | None:
        """Find the topic."""
        # The metadata may name any of them.
        for file in self.path.iterdir() if self.path.is_dir() else ():
            if not file.is_dir():
                check_file(file)
        topics = self._topics()
        self.topic = _chosen(self.path, topics, self.topic)
        self._kind = topics[self.topic].kind
        return topics[self.topic].messages

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
        self._bits = SampleBits()
        read = 0
        with self._reader() as reader:
            wanted = [each for each in reader.connections if each.topic == self.topic]
            expected = sum(each.msgcount for each in wanted)
            messages = iter(reader.messages(connections=wanted))
            problem: Exception | None = None
            while True:
                try:
                    _, recorded_ns, data = next(messages)
                except StopIteration:
                    break
                except Exception as error:
                    # rosbags and SQLite raise whatever the damage made of it.
                    problem = error
                    break
                read += 1
                yield self._entry(recorded_ns, data)
        # Damaged places inside of chunks are skipped by rosbags.
        if problem is not None or read < expected:
            why = '' if problem is None else f' ({problem!r})'
            raise DamagedError(
                f'{self.path} is damaged: {read} of {expected} images on {self.topic} can be '
                f'read{why}; mend it: {self._remedy()}'
            ) from problem

    def _entry(self, recorded_ns: int, data: bytes) -> Entry:
        try:
            message = self._deserialized(data)
        except InputError as error:
            return Entry(0, recorded_ns, '', partial(_fail, error))
        stamp = message.header.stamp
        header_ns = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
        decode = partial(self.read, message, self._max_pixels, self._bits)
        shape = claimed_shape(message) or (0, 0)
        return Entry(header_ns, recorded_ns, message.header.frame_id, decode, shape)

    def _deserialized(self, data: bytes) -> Any:
        try:
            if self.path.suffix == '.bag':
                return _types('ROS1_NOETIC').deserialize_ros1(data, self._kind)
            return _types('ROS2_JAZZY').deserialize_cdr(_unpacked(data), self._kind)
        except Exception as error:
            # rosbags raises whatever the data made of it.
            raise InputError(f'the message cannot be read ({error!r})') from error

    @contextmanager
    def _reader(self) -> Iterator[Any]:
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2

        reader = Reader1(self.path) if self.path.suffix == '.bag' else Reader2(self.path)
        if isinstance(reader, Reader2):
            reader.storage.path = _UriPath(self.path)
        try:
            reader.open()
            yield reader
        finally:
            # Also if it cannot be opened, for which rosbags may leave files open.
            with suppress(Exception):
                reader.close()

    def _topics(self) -> dict[str, Topic]:
        try:
            with self._reader() as reader:
                found: dict[str, Topic] = {}
                for each in reader.connections:
                    before = found[each.topic].messages if each.topic in found else 0
                    found[each.topic] = Topic(each.msgtype, (before or 0) + int(each.msgcount))
                return found
        except Exception as error:
            # rosbags and SQLite raise whatever the damage made of it.
            raise SequenceError(
                f'{self.path} cannot be read as a bag: {error}; mend it: {self._remedy()}'
            ) from error

    def _remedy(self) -> str:
        """Return the command that mends the bag."""
        if self.path.is_dir() and not (self.path / 'metadata.yaml').is_file():
            return _REMEDIES['']
        if self.path.suffix == '.zstd':
            return _REMEDIES['.zstd']
        names = [each.name.removesuffix('.zstd') for each in _storage_files(self.path)]
        return _REMEDIES[Path(names[0]).suffix if names else '']


def _unpacked(data: bytes) -> bytes:
    """Return a message as it was before rosbag2 packed it, of which only its metadata tells."""
    if data[:4] != _ZSTD:
        return data
    import zstandard

    return zstandard.ZstdDecompressor().decompressobj().decompress(data)


def _fail(error: InputError) -> NDArray[np.uint8]:
    raise error


def _chosen(path: Path, topics: dict[str, Topic], wanted: str) -> str:
    """
    Return the topic to read.

    :raises SequenceError: with a list of the topics if it is not there or not clear.
    """
    images = {name: topic for name, topic in topics.items() if topic.kind in (_IMAGE, _COMPRESSED)}
    if wanted:
        names = [name for name in (wanted, f'/{wanted}') if name in topics]
        if names and names[0] in images:
            return names[0]
        what = f'is {_about(topics[names[0]])}' if names else 'is not there'
        raise SequenceError(
            f'{path}: topic {wanted} {what}; topics with images: {_listed(images or topics)}'
        )
    filled = [name for name, topic in images.items() if topic.messages != 0]
    if len(filled) == 1:
        return filled[0]
    if not filled:
        raise SequenceError(
            f'{path} has no images (sensor_msgs/Image or CompressedImage); its topics: '
            f'{_listed(topics)}'
        )
    raise SequenceError(
        f'{path} has {len(filled)} topics with images, choose one with --topic (topic:= of a '
        f'launch file): {_listed({name: images[name] for name in filled})}'
    )


def _listed(topics: dict[str, Topic]) -> str:
    return ', '.join(f'{name} ({_about(topics[name])})' for name in sorted(topics)) or 'none'


def _about(topic: Topic) -> str:
    return f'{topic.kind}' + ('' if topic.messages is None else f', {topic.messages} messages')


@cache
def _types(store: str) -> Any:
    """Return types of messages: images mean the same in every distribution of ROS 1 and ROS 2."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores[store])
