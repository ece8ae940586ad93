# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ROS 1 bags of format 2.0 whose end is missing."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from gait_segmentation.inputs.damaged.parts import BrokenError, Bytes, Message, unpacked

__all__ = ['scan']

_MAGIC = b'#ROSBAG V2.0\n'
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7


def scan(data: Bytes, path: Path) -> Iterator[Message]:
    """
    Yield topics and messages from the front.

    :raises BrokenError: where the file breaks off.
    """
    if data[: len(_MAGIC)] != _MAGIC:
        raise BrokenError('it does not begin like a bag of version 2.0')
    connections: dict[int, tuple[str, str]] = {}
    for fields, start, end in _records(data, len(_MAGIC)):
        if fields.get('op') != bytes([_CHUNK]):
            continue
        inside = unpacked(fields.get('compression', b'').decode(), bytes(data[start:end]))
        for inner, first, last in _records(inside, 0):
            if last > len(inside):
                break
            try:
                yield from _record(inner, bytes(inside[first:last]), connections)
            except (KeyError, struct.error):
                raise BrokenError(
                    f'byte {start}: inside a chunk, a record makes no sense'
                ) from None
        if end > len(data):
            raise BrokenError(f'byte {start}: a chunk is cut off')
    raise BrokenError(f'byte {len(data)}: the end is missing')


def _record(
    fields: dict[str, bytes], data: bytes, connections: dict[int, tuple[str, str]]
) -> Iterator[Message]:
    operation = (fields.get('op') or b'\0')[0]
    if operation == _CONNECTION:
        kind = _fields(data).get('type', b'').decode()
        name = fields.get('topic', b'').decode()
        connection = connections[_number(fields['conn'])] = (name, kind.replace('/', '/msg/', 1))
        yield Message(*connection, 0, None)
    elif operation == _MESSAGE and _number(fields['conn']) in connections:
        seconds, nanoseconds = struct.unpack('<II', fields['time'])
        recorded_ns = seconds * 1_000_000_000 + nanoseconds
        yield Message(*connections[_number(fields['conn'])], recorded_ns, data)


def _number(field: bytes) -> int:
    return int.from_bytes(field, 'little')


def _records(data: Bytes, at: int) -> Iterator[tuple[dict[str, bytes], int, int]]:
    """Yield header, first byte and end of the data of records; the last may be cut off."""
    while at < len(data):
        try:
            (length,) = struct.unpack_from('<I', data, at)
            fields = _fields(bytes(data[at + 4 : at + 4 + length]))
            (size,) = struct.unpack_from('<I', data, at + 4 + length)
        except (struct.error, ValueError):
            raise BrokenError(f'byte {at}: a record is cut off') from None
        start = at + 8 + length
        yield fields, start, start + size
        at = start + size


def _fields(header: bytes) -> dict[str, bytes]:
    fields: dict[str, bytes] = {}
    at = 0
    while at < len(header):
        (length,) = struct.unpack_from('<I', header, at)
        name, _, value = header[at + 4 : at + 4 + length].partition(b'=')
        fields[name.decode()] = value
        at += 4 + length
    return fields
