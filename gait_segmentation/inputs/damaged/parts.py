# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the readers of all damaged formats have in common."""

from __future__ import annotations

import bz2
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import lz4.frame

__all__ = ['BrokenError', 'Bytes', 'Message', 'unpack_file', 'unpacked', 'unpacked_message']

Bytes = Any
"""bytes, or the map of a file."""


_ZSTD = b'\x28\xb5\x2f\xfd'
"""How data that zstd has packed begins, and no message of ROS 2 does."""

_PIECE = 1 << 20


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


def unpacked_message(data: bytes) -> bytes:
    """Return a message as it was before rosbag2 packed it, of which only its metadata tells."""
    return unpacked('zstd', data) if data[:4] == _ZSTD else data


def unpack_file(path: Path, output: Path) -> None:
    """Unpack a file that zstd has packed for as far as it goes."""
    unpacker = _zstd()
    with open(path, 'rb') as packed, open(output, 'wb') as file:
        while not unpacker.eof and (piece := packed.read(_PIECE)):
            try:
                file.write(unpacker.decompress(piece))
            except OSError:
                raise
            except Exception:
                # Every library has errors of its own; what is read will say where it ends.
                return


def _zstd() -> Any:
    # Which package there is depends on the versions of Python and of rosbags.
    for name in ('compression.zstd', 'backports.zstd'):
        try:
            return importlib.import_module(name).ZstdDecompressor()
        except ImportError:
            continue
    import zstandard

    return zstandard.ZstdDecompressor().decompressobj()


_UNPACK: dict[str, Callable[[bytes], bytes]] = {
    'zstd': lambda data: bytes(_zstd().decompress(data)),
    'lz4': lambda data: bytes(lz4.frame.LZ4FrameDecompressor().decompress(data)),
    'bz2': lambda data: bz2.BZ2Decompressor().decompress(data),
}
