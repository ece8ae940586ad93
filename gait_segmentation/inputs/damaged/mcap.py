# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""MCAP files whose end is missing, by the MCAP specification."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from gait_segmentation.inputs.damaged.parts import BrokenError, Bytes, Message, unpacked

__all__ = ['scan']

_MAGIC = b'\x89MCAP0\r\n'
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15


def scan(data: Bytes, path: Path) -> Iterator[Message]:
    """
    Yield topics and messages from the front.

    :raises BrokenError: where the file breaks off.
    """
    if data[:8] != _MAGIC:
        raise BrokenError('it does not begin like an MCAP file')
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    for operation, start, end in _records(data, 8):
        if operation == _DATA_END:
            return
        if operation != _CHUNK:
            if end > len(data):
                raise BrokenError(f'byte {start}: a record is cut off')
            yield from _record(data, operation, start, end, schemas, channels)
            continue
        try:
            compression, at = _string(data, start + 28)
            inside = unpacked(compression, bytes(data[at + 8 : end]))
        except struct.error:
            raise BrokenError(f'byte {start}: a chunk is cut off') from None
        try:
            for inner, first, last in _records(inside, 0):
                if last > len(inside):
                    break
                yield from _record(inside, inner, first, last, schemas, channels)
        except BrokenError as error:
            raise BrokenError(f'byte {start}: inside a chunk, {error}') from None
        if end > len(data):
            raise BrokenError(f'byte {start}: a chunk is cut off')
    raise BrokenError(f'byte {len(data)}: the end is missing')


def _records(data: Bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """Yield operation, first byte and end of records; the last may end behind the data."""
    while at < len(data):
        if at + 9 > len(data):
            raise BrokenError(f'byte {at}: a record is cut off')
        operation, length = struct.unpack_from('<BQ', data, at)
        if not 0 < operation < 0x10:
            raise BrokenError(f'byte {at}: there is no record')
        yield operation, at + 9, at + 9 + length
        at += 9 + length


def _record(
    data: Bytes,
    operation: int,
    start: int,
    end: int,
    schemas: dict[int, str],
    channels: dict[int, tuple[str, str]],
) -> Iterator[Message]:
    try:
        if operation == _SCHEMA:
            schemas[struct.unpack_from('<H', data, start)[0]] = _string(data, start + 2)[0]
        elif operation == _CHANNEL:
            channel, schema = struct.unpack_from('<HH', data, start)
            channels[channel] = (_string(data, start + 4)[0], schemas.get(schema, ''))
            yield Message(*channels[channel], 0, None)
        elif operation == _MESSAGE:
            channel, _, recorded_ns, _ = struct.unpack_from('<HIQQ', data, start)
            if channel in channels:
                yield Message(*channels[channel], recorded_ns, bytes(data[start + 22 : end]))
    except struct.error:
        raise BrokenError(f'byte {start}: a record is too short') from None


def _string(data: Bytes, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from('<I', data, at)
    return bytes(data[at + 4 : at + 4 + length]).decode(errors='replace'), at + 4 + length
