# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Reading bags from the front for as far as they go.

For bags whose end is missing (a recording that was killed, a full disk, a copy that was cut off)
and which ``rosbags`` therefore does not open.
"""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterator
from pathlib import Path

from gait_segmentation.inputs.damaged import mcap, ros1, sqlite
from gait_segmentation.inputs.damaged.parts import (
    BrokenError,
    Message,
    unpack_file,
    unpacked_message,
)

__all__ = ['BrokenError', 'messages', 'topics', 'unpacked_message']

_SCANS = {'.mcap': mcap.scan, '.db3': sqlite.scan, '.bag': ros1.scan}


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


def _scan(path: Path) -> Iterator[Message]:
    if path.suffix != '.zstd':
        yield from _scan_unpacked(path)
        return
    with tempfile.TemporaryDirectory(prefix='gait_segmentation') as folder:
        inner = Path(folder) / path.stem
        try:
            unpack_file(path, inner)
        except OSError as error:
            raise BrokenError(f'{path.name}: {error}') from error
        yield from _scan_unpacked(inner)


def _scan_unpacked(path: Path) -> Iterator[Message]:
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
