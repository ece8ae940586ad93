# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the readers of all damaged formats have in common."""

from __future__ import annotations

import bz2
from collections.abc import Callable
from typing import Any, NamedTuple

import lz4.frame

__all__ = ['BrokenError', 'Bytes', 'Message', 'unpacked']

Bytes = Any
"""bytes, or the map of a file."""


class BrokenError(Exception):
    """Nothing behind this place can be read; the text says where it is."""


class Message(NamedTuple):
    """A message, or the news of a topic (no data)."""

    topic: str
    kind: str
    recorded_ns: int
    data: bytes | None


def unpacked(compression: str, data: bytes) -> bytes:
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
