# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Marks by which outputs are known again, and a digest by which inputs are.

What has no mark was made by somebody else, or by hand, and is not to be replaced.
"""

from __future__ import annotations

import hashlib
import os
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['digest_of', 'film_is_marked', 'mark_film', 'mask_png', 'png_is_marked']

_MARK = b'Software\0gait_segmentation'

_PNG_HEAD = 33
"""Bytes of the signature and the header of a PNG, behind which other chunks may come."""

_CHUNK = (
    struct.pack('>I', len(_MARK))
    + b'tEXt'
    + _MARK
    + struct.pack('>I', zlib.crc32(b'tEXt' + _MARK))
)

_BOX = struct.pack('>I', 8 + len(_MARK)) + b'free' + _MARK
"""A box of MPEG-4 that players skip, and so do those of other formats behind their end."""

_ENDS_BYTES = 1 << 16


def mask_png(mask: NDArray[np.uint8]) -> bytes:
    """Return a (H, W) uint8 mask as a PNG with the mark."""
    data = cv2.imencode('.png', mask)[1].tobytes()
    return data[:_PNG_HEAD] + _CHUNK + data[_PNG_HEAD:]


def png_is_marked(path: Path) -> bool:
    """Return whether a file is a PNG with the mark."""
    with path.open('rb') as file:
        return file.read(_PNG_HEAD + len(_CHUNK))[_PNG_HEAD:] == _CHUNK


def mark_film(path: Path) -> None:
    """Add the mark to the end of a film."""
    with path.open('ab') as file:
        file.write(_BOX)


def film_is_marked(path: Path) -> bool:
    """Return whether a file ends with the mark."""
    with path.open('rb') as file:
        file.seek(max(path.stat().st_size - len(_BOX), 0))
        return file.read() == _BOX


def digest_of(path: Path) -> str:
    """
    Return a digest that tells inputs apart wherever they are, and takes little time.

    It is of the size of a file, its beginning and its end; of a folder, of the names and sizes of
    its files.  It is empty for what is not there or is neither.
    """
    digest = hashlib.sha256()
    if path.is_dir():
        files = sorted(each for each in path.rglob('*') if each.is_file())
        for each in files:
            # Not encoded as text: names need not be UTF-8.
            digest.update(os.fsencode(each.relative_to(path)) + b'\0')
            digest.update(f'{each.stat().st_size}\0'.encode())
    elif path.is_file():
        with path.open('rb') as file:
            size = os.fstat(file.fileno()).st_size
            digest.update(f'{size}\0'.encode() + file.read(_ENDS_BYTES))
            file.seek(max(size - _ENDS_BYTES, 0))
            digest.update(file.read())
    else:
        return ''
    return digest.hexdigest()[:32]
