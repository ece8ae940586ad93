# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Databases of rosbag2 whose end is missing, by the file format of SQLite."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from gait_segmentation.inputs.damaged.parts import BrokenError, Bytes, Message

__all__ = ['scan']


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


def scan(data: Bytes, path: Path) -> Iterator[Message]:
    """
    Read the messages page by page.

    SQLite itself finds rows from the root of a tree, parts of which are written late and are
    missing first; the leaves with the rows lie in the file in the order of recording.

    :raises BrokenError: where the file breaks off, unless it is whole.
    """
    connections = _topics(path)
    for name, kind in connections.values():
        yield Message(name, kind, 0, None)
    size = int.from_bytes(data[16:18], 'big')
    size = 65536 if size == 1 else size
    usable = size - data[20]
    if size < 512 or usable < 480:
        raise BrokenError(f'a page cannot have {size} bytes')
    rows = sorted(row for row in _rows(data, size, usable) if row.topic in connections)
    last = 0
    for row in rows:
        content = _payload(data, row, size, usable)
        if content is None:
            raise BrokenError(f'behind message {last}, message {row.number} is cut off')
        yield Message(*connections[row.topic], row.recorded_ns, content)
        last = row.number
    pages = int.from_bytes(data[28:32], 'big')
    # Messages are numbered through, whatever their topic.
    if pages * size != len(data) or (rows and last - rows[0].number + 1 != len(rows)):
        raise BrokenError(f'behind message {last}')


def _topics(path: Path) -> dict[int, tuple[str, str]]:
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


def _rows(data: Bytes, size: int, usable: int) -> Iterator[_Row]:
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
                row = _row(leaf, at, usable)
            except (IndexError, struct.error):
                continue
            if row is not None:
                yield row


def _row(leaf: bytes, at: int, usable: int) -> _Row | None:
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


def _payload(data: Bytes, row: _Row, size: int, usable: int) -> bytes | None:
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
