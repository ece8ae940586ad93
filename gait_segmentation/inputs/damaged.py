# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Bags that cannot be opened as they should, read from the front for as far as libraries read them.

Their end is missing (a recording that was killed, a full disk, a copy that was cut off), or the
metadata of their folder.
"""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple

__all__ = ['BrokenError', 'messages', 'remedy', 'topics', 'unpacked_message']

_ZSTD = b'\x28\xb5\x2f\xfd'
"""How data that zstd has packed begins, and no message of ROS 2 does."""

_REMEDIES = {
    '.bag': 'rosbag reindex FILE',
    '.db3': 'sqlite3 FILE .recover | sqlite3 NEW',
    '.mcap': 'mcap recover FILE -o NEW',
}

_ROWS = """
    SELECT name, type, timestamp, data FROM messages JOIN topics ON topics.id = topic_id
    ORDER BY messages.id
"""


class BrokenError(Exception):
    """Nothing behind this place can be read; the text says where it is."""


class Message(NamedTuple):
    """A message, or the news of a topic (no data)."""

    topic: str
    kind: str
    recorded_ns: int
    data: bytes | None


def remedy(path: Path) -> str:
    """Return what may save more of a file of a bag, as a part of a sentence."""
    command = _REMEDIES[Path(path.name.removesuffix('.zstd')).suffix]
    return f'; what may save more of it: {command}'


def topics(path: Path) -> dict[str, str]:
    """Return the types of the topics that can be found, by name."""
    found: dict[str, str] = {}
    try:
        for message in _scan(path):
            # SQLite keeps values of any type.
            found[str(message.topic)] = str(message.kind)
    except BrokenError:
        pass
    return found


def messages(path: Path, topic: str) -> Iterator[tuple[int, bytes]]:
    """
    Yield time of recording in nanoseconds and data of the messages of a topic.

    :raises BrokenError: where the file breaks off.
    """
    for message in _scan(path):
        if message.topic == topic and message.data is not None:
            yield message.recorded_ns, message.data


def unpacked_message(data: bytes) -> bytes:
    """Return a message as it was before rosbag2 packed it, of which only its metadata tells."""
    if data[:4] != _ZSTD:
        return data
    import zstandard

    return zstandard.ZstdDecompressor().decompressobj().decompress(data)


def _scan(path: Path) -> Iterator[Message]:
    """
    Yield topics and messages from the front.

    :raises BrokenError: where the file breaks off.
    """
    with tempfile.TemporaryDirectory(prefix='gait_segmentation') as folder:
        try:
            file = _unpacked(path, Path(folder)) if path.suffix == '.zstd' else path
            if file.suffix not in _SCANS:
                raise BrokenError('it is only read as a whole')
            yield from _SCANS[file.suffix](file)
        except BrokenError as error:
            raise BrokenError(f'{path.name}: {error}') from error.__cause__
        except OSError as error:
            raise BrokenError(f'{path.name}: {error}') from error


def _unpacked(path: Path, folder: Path) -> Path:
    """Unpack a file that zstd has packed for as far as it goes."""
    import zstandard

    inner = folder / path.stem
    with open(path, 'rb') as packed, open(inner, 'wb') as file:
        data = zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
        # What is read of it will say where it ends.
        with suppress(zstandard.ZstdError):
            shutil.copyfileobj(data, file)
    return inner


def _mcap(path: Path) -> Iterator[Message]:
    from mcap import exceptions, records
    from mcap.stream_reader import StreamReader

    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    with open(path, 'rb') as file:
        reader = iter(StreamReader(file, record_size_limit=path.stat().st_size).records)
        while True:
            try:
                record = next(reader)
            except exceptions.EndOfFile as error:
                raise BrokenError(f'byte {file.tell()}: the end is missing') from error
            except Exception as error:
                # Those of all libraries that it unpacks chunks with.
                raise BrokenError(f'byte {file.tell()}: {error!r}') from error
            if isinstance(record, records.DataEnd):
                return
            if isinstance(record, records.Schema):
                schemas[record.id] = record.name
            elif isinstance(record, records.Channel):
                channels[record.id] = (record.topic, schemas.get(record.schema_id, ''))
                yield Message(*channels[record.id], 0, None)
            elif isinstance(record, records.Message) and record.channel_id in channels:
                yield Message(*channels[record.channel_id], record.log_time, record.data)


def _sqlite(path: Path) -> Iterator[Message]:
    address = f'{path.resolve().as_uri()}?mode=ro&immutable=1'
    read = 0
    try:
        with closing(sqlite3.connect(address, uri=True)) as database:
            # Lets SQLite read a file that is shorter than its header says.
            database.execute('PRAGMA writable_schema = ON')
            for name, kind in database.execute('SELECT name, type FROM topics'):
                yield Message(name, kind, 0, None)
            for row in database.execute(_ROWS):
                yield Message(*row)
                read += 1
    except sqlite3.Error as error:
        raise BrokenError(f'behind message {read}: {error}') from error


_SCANS = {'.mcap': _mcap, '.db3': _sqlite}
"""Of the bags of which a part can be read."""
