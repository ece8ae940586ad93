# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Reading bags from the front for as far as they go.

For bags whose end is missing (a recording that was killed, a full disk, a copy that was cut off)
and which ``rosbags`` therefore does not open.  The layouts are those of the MCAP specification,
of the ROS bag format 2.0 and of rosbag2's SQLite storage.
"""

from __future__ import annotations

import bz2
import mmap
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import lz4.frame

__all__ = ['BrokenError', 'messages', 'topics']


class BrokenError(Exception):
    """Nothing behind this place can be read; the text says where it is."""


class _Message(NamedTuple):
    """A message, or the news of a topic (no data)."""

    topic: str
    kind: str
    recorded_ns: int
    data: bytes | None


def topics(path: Path) -> dict[str, str]:
    """Return the types of the topics that can be found, by name."""
    found: dict[str, str] = {}
    try:
        for message in _scan(path):
            found[message.topic] = message.kind
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


def _scan(path: Path) -> Iterator[_Message]:
    scan = _SCANS[path.suffix]
    try:
        with (
            open(path, 'rb') as file,
            mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data,
        ):
            yield from scan(data, path)
    except (OSError, ValueError) as error:
        # An empty file cannot be mapped.
        raise BrokenError(f'{path.name}: {error}') from error
    except BrokenError as error:
        raise BrokenError(f'{path.name}: {error}') from None


Bytes = Any
"""bytes, or the map of a file."""


def _string(data: Bytes, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from('<I', data, at)
    return bytes(data[at + 4 : at + 4 + length]).decode(errors='replace'), at + 4 + length


_MCAP_MAGIC = b'\x89MCAP0\r\n'
_MCAP_SCHEMA, _MCAP_CHANNEL, _MCAP_MESSAGE, _MCAP_CHUNK, _MCAP_DATA_END = 3, 4, 5, 6, 15


def _scan_mcap(data: Bytes, path: Path) -> Iterator[_Message]:
    if data[:8] != _MCAP_MAGIC:
        raise BrokenError('it does not begin like an MCAP file')
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    for operation, start, end in _mcap_records(data, 8):
        if operation == _MCAP_DATA_END:
            return
        if operation != _MCAP_CHUNK:
            if end > len(data):
                raise BrokenError(f'byte {start}: a record is cut off')
            yield from _mcap_record(data, operation, start, end, schemas, channels)
            continue
        try:
            compression, at = _string(data, start + 28)
            inside = _unpacked(compression, bytes(data[at + 8 : end]))
        except struct.error:
            raise BrokenError(f'byte {start}: a chunk is cut off') from None
        try:
            for inner, first, last in _mcap_records(inside, 0):
                if last > len(inside):
                    break
                yield from _mcap_record(inside, inner, first, last, schemas, channels)
        except BrokenError as error:
            raise BrokenError(f'byte {start}: inside a chunk, {error}') from None
        if end > len(data):
            raise BrokenError(f'byte {start}: a chunk is cut off')
    raise BrokenError(f'byte {len(data)}: the end is missing')


def _mcap_records(data: Bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """Yield operation, first byte and end of records; the last may end behind the data."""
    while at < len(data):
        if at + 9 > len(data):
            raise BrokenError(f'byte {at}: a record is cut off')
        operation, length = struct.unpack_from('<BQ', data, at)
        if not 0 < operation < 0x10:
            raise BrokenError(f'byte {at}: there is no record')
        yield operation, at + 9, at + 9 + length
        at += 9 + length


def _mcap_record(
    data: Bytes,
    operation: int,
    start: int,
    end: int,
    schemas: dict[int, str],
    channels: dict[int, tuple[str, str]],
) -> Iterator[_Message]:
    try:
        if operation == _MCAP_SCHEMA:
            schemas[struct.unpack_from('<H', data, start)[0]] = _string(data, start + 2)[0]
        elif operation == _MCAP_CHANNEL:
            channel, schema = struct.unpack_from('<HH', data, start)
            channels[channel] = (_string(data, start + 4)[0], schemas.get(schema, ''))
            yield _Message(*channels[channel], 0, None)
        elif operation == _MCAP_MESSAGE:
            channel, _, recorded_ns, _ = struct.unpack_from('<HIQQ', data, start)
            if channel in channels:
                yield _Message(*channels[channel], recorded_ns, bytes(data[start + 22 : end]))
    except struct.error:
        raise BrokenError(f'byte {start}: a record is too short') from None


_ROS1_MAGIC = b'#ROSBAG V2.0\n'
_ROS1_MESSAGE, _ROS1_CHUNK, _ROS1_CONNECTION = 2, 5, 7


def _scan_ros1(data: Bytes, path: Path) -> Iterator[_Message]:
    if data[: len(_ROS1_MAGIC)] != _ROS1_MAGIC:
        raise BrokenError('it does not begin like a bag of version 2.0')
    connections: dict[int, tuple[str, str]] = {}
    for fields, start, end in _ros1_records(data, len(_ROS1_MAGIC)):
        if fields.get('op') != bytes([_ROS1_CHUNK]):
            continue
        inside = _unpacked(fields.get('compression', b'').decode(), bytes(data[start:end]))
        for inner, first, last in _ros1_records(inside, 0):
            if last > len(inside):
                break
            operation = (inner.get('op') or b'\0')[0]
            if operation == _ROS1_CONNECTION:
                kind = _ros1_fields(bytes(inside[first:last])).get('type', b'').decode()
                name = inner.get('topic', b'').decode()
                connections[_number(inner['conn'])] = (name, kind.replace('/', '/msg/', 1))
                yield _Message(*connections[_number(inner['conn'])], 0, None)
            elif operation == _ROS1_MESSAGE and _number(inner['conn']) in connections:
                seconds, nanoseconds = struct.unpack('<II', inner['time'])
                recorded_ns = seconds * 1_000_000_000 + nanoseconds
                about = connections[_number(inner['conn'])]
                yield _Message(*about, recorded_ns, bytes(inside[first:last]))
        if end > len(data):
            raise BrokenError(f'byte {start}: a chunk is cut off')
    raise BrokenError(f'byte {len(data)}: the end is missing')


def _number(field: bytes) -> int:
    return int.from_bytes(field, 'little')


def _ros1_records(data: Bytes, at: int) -> Iterator[tuple[dict[str, bytes], int, int]]:
    """Yield header, first byte and end of the data of records; the last may be cut off."""
    while at < len(data):
        try:
            (length,) = struct.unpack_from('<I', data, at)
            fields = _ros1_fields(bytes(data[at + 4 : at + 4 + length]))
            (size,) = struct.unpack_from('<I', data, at + 4 + length)
        except (struct.error, ValueError):
            raise BrokenError(f'byte {at}: a record is cut off') from None
        start = at + 8 + length
        yield fields, start, start + size
        at = start + size


def _ros1_fields(header: bytes) -> dict[str, bytes]:
    fields: dict[str, bytes] = {}
    at = 0
    while at < len(header):
        (length,) = struct.unpack_from('<I', header, at)
        name, _, value = header[at + 4 : at + 4 + length].partition(b'=')
        fields[name.decode()] = value
        at += 4 + length
    return fields


class _Row(NamedTuple):
    """A row of the table of messages: number, topic, time, and where its data are."""

    number: int
    topic: int
    recorded_ns: int
    payload: int
    local: bytes
    skip: int
    overflow: int


_TABLE_LEAF = 13
_ROW_COLUMNS = 4


def _scan_sqlite(data: Bytes, path: Path) -> Iterator[_Message]:
    """
    Read the messages page by page.

    SQLite itself finds rows from the root of a tree, parts of which are written late and are
    missing first; the leaves with the rows lie in the file in the order of recording.
    """
    connections = _sqlite_topics(path)
    for name, kind in connections.values():
        yield _Message(name, kind, 0, None)
    size = int.from_bytes(data[16:18], 'big')
    size = 65536 if size == 1 else size
    usable = size - data[20]
    if size < 512 or usable < 480:
        raise BrokenError(f'a page cannot have {size} bytes')
    rows = sorted(row for row in _sqlite_rows(data, size, usable) if row.topic in connections)
    last = 0
    for row in rows:
        content = _sqlite_payload(data, row, size, usable)
        if content is None:
            raise BrokenError(f'behind message {last}, message {row.number} is cut off')
        yield _Message(*connections[row.topic], row.recorded_ns, content)
        last = row.number
    raise BrokenError(f'behind message {last}')


def _sqlite_topics(path: Path) -> dict[int, tuple[str, str]]:
    connection = sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro&immutable=1', uri=True)
    try:
        # Lets SQLite read a file that is shorter than its header says.
        connection.execute('PRAGMA writable_schema = ON')
        rows = connection.execute('SELECT id, name, type FROM topics')
        return {number: (name, kind) for number, name, kind in rows}
    except sqlite3.Error as error:
        raise BrokenError(str(error)) from error
    finally:
        connection.close()


def _sqlite_rows(data: Bytes, size: int, usable: int) -> Iterator[_Row]:
    """
    Yield the rows in leaves of tables that look like those of messages.

    Pages of large blobs are never taken for leaves: they begin with a page number.
    """
    for page in range(size, len(data) - size + 1, size):
        if data[page] != _TABLE_LEAF:
            continue
        leaf = bytes(data[page : page + size])
        (cells,) = struct.unpack_from('>H', leaf, 3)
        for cell in range(min(cells, (size - 8) // 2)):
            (at,) = struct.unpack_from('>H', leaf, 8 + 2 * cell)
            try:
                row = _sqlite_row(leaf, at, usable)
            except (IndexError, struct.error):
                continue
            if row is not None:
                yield row


def _sqlite_row(leaf: bytes, at: int, usable: int) -> _Row | None:
    payload, at = _varint(leaf, at)
    number, at = _varint(leaf, at)
    local, most = payload, usable - 35
    if payload > most:
        least = (usable - 12) * 32 // 255 - 23
        local = least + (payload - least) % (usable - 4)
        local = local if local <= most else least
    content = leaf[at : at + local]
    overflow = struct.unpack_from('>I', leaf, at + local)[0] if local < payload else 0
    header, place = _varint(content, 0)
    kinds = []
    while place < header:
        kind, place = _varint(content, place)
        kinds.append(kind)
    # The first column is the row's number and is not stored again; the last is a blob.
    if len(kinds) != _ROW_COLUMNS or kinds[0] or kinds[3] < 12 or kinds[3] % 2:
        return None
    topic, place = _integer(content, place, kinds[1])
    recorded_ns, place = _integer(content, place, kinds[2])
    return _Row(number, topic, recorded_ns, payload, content, place, overflow)


def _sqlite_payload(data: Bytes, row: _Row, size: int, usable: int) -> bytes | None:
    """Return the data of a row, None if they are not all there."""
    parts = [row.local]
    missing = row.payload - len(row.local)
    page = row.overflow
    while missing > 0:
        start = (page - 1) * size
        if page < 1 or start + size > len(data):
            return None
        parts.append(bytes(data[start + 4 : start + min(usable, 4 + missing)]))
        missing -= len(parts[-1])
        page = int.from_bytes(bytes(data[start : start + 4]), 'big')
    return b''.join(parts)[row.skip :]


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a number of SQLite's variable length, and the place behind it."""
    value = 0
    for index in range(8):
        byte = data[at + index]
        value = value << 7 | byte & 127
        if byte < 128:
            return value, at + index + 1
    return value << 8 | data[at + 8], at + 9


def _integer(data: bytes, at: int, kind: int) -> tuple[int, int]:
    """Return an integer column of a serial type, and the place behind it."""
    if kind in (8, 9):
        return kind - 8, at
    length = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8}.get(kind, 0)
    return int.from_bytes(data[at : at + length], 'big', signed=True), at + length


def _unpacked(compression: str, data: bytes) -> bytes:
    """Return as much of a compressed chunk as there is."""
    if compression in ('', 'none'):
        return data
    unpack = _UNPACK.get(compression)
    if unpack is None:
        raise BrokenError(f'a chunk is compressed with {compression!r}, which is not known')
    try:
        return unpack(data)
    except Exception as error:
        # Every library has errors of its own.
        raise BrokenError(f'a chunk cannot be unpacked: {error}') from error


def _unpack_zstd(data: bytes) -> bytes:
    # Older versions of rosbags bring one package, newer ones another.
    try:
        from backports import zstd
    except ImportError:
        import zstandard

        return bytes(zstandard.ZstdDecompressor().decompressobj().decompress(data))
    return bytes(zstd.ZstdDecompressor().decompress(data))


_UNPACK: dict[str, Callable[[bytes], bytes]] = {
    'zstd': _unpack_zstd,
    'lz4': lambda data: bytes(lz4.frame.LZ4FrameDecompressor().decompress(data)),
    'bz2': lambda data: bz2.BZ2Decompressor().decompress(data),
}

_SCANS = {'.mcap': _scan_mcap, '.db3': _scan_sqlite, '.bag': _scan_ros1}
