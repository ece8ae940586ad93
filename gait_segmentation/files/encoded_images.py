# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Decoding images, after a look at the size that their header claims.

The decoder makes room for that size before it looks at the pixels, so a few bytes could claim all
memory and a few megabytes, which pack well, could take minutes.
"""

from __future__ import annotations

import re
import struct

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

__all__ = ['FORMATS', 'MOST_PIXELS', 'check_pixels', 'claimed_size', 'decode_image']

MOST_PIXELS = 1 << 26
"""Of an image, unless more are allowed: few cameras have more, and memory is made for them."""

FORMATS = 'PNG, JPEG, BMP, PNM, TIFF or WebP'
"""What can be decoded; OpenCV knows more, which no camera sends and nobody's masks are in."""

_MOST_SCANS = 100
"""
Passes over its pixels that a JPEG may make, and 10 are usual: each takes time for all pixels, and
hardly any bytes.
"""

_MOST_PIXELS_PER_BYTE = 8 * 64
"""Of a JPEG: each block of 8 x 8 pixels takes a bit at least."""

_FILLED = 128
"""What OpenCV 4 fills up a JPEG with of which data are missing."""

_MOST_PARTS = 4096
"""Segments of a JPEG, or entries of a TIFF directory, that are looked through for the size."""

_PNG, _JPEG = b'\x89PNG\r\n\x1a\n', b'\xff\xd8\xff'
_CHUNK = 12
"""Bytes of a PNG's chunk beside its data: length, kind and checksum."""

_SPACE = rb'(?:\s|#[^\r\n]*[\r\n])+'
_PNM = re.compile(rb'P[1-6]' + _SPACE + rb'(\d{1,10})' + _SPACE + rb'(\d{1,10})(?!\d)')
_FILL = re.compile(rb'\xff+')
_SCAN, _END = b'\xff\xda', b'\xff\xd9'
_ALONE = (0x00, 0x01, *range(0xD0, 0xD9))
"""Markers of a JPEG without a segment behind them, and what is none."""

_FRAME = (*range(0xC0, 0xC4), *range(0xC5, 0xC8), *range(0xC9, 0xCC), *range(0xCD, 0xD0))
"""Markers of the segment that holds the size."""

_WIDTH, _HEIGHT = 256, 257
"""Tags of a TIFF."""

_WHOLE_NUMBERS = {1: 'B', 3: 'H', 4: 'I', 6: 'b', 8: 'h', 9: 'i', 16: 'Q', 17: 'q'}
"""Types of a TIFF's values, as ``struct`` calls them."""

Size = tuple[int, int]


def check_pixels(size: tuple[int, int], most: int = MOST_PIXELS) -> None:
    """
    Refuse image sizes from messages and files that no camera has.

    :param size: width and height.
    :param most: pixels there may be.
    :raises InputError: if there are more.
    """
    if size[0] * size[1] > most:
        raise InputError(
            f'image must have at most {most} pixels (max_pixels), got {size[0]} x {size[1]}'
        )


def decode_image(
    data: NDArray[np.uint8], flags: int, *, name: str, most: int = MOST_PIXELS
) -> NDArray[np.uint8]:
    """
    Decode an image.

    :param data: (n,) uint8, the contents of the file or message.
    :param flags: how, as ``cv2.imdecode`` takes it.
    :param name: what errors call the image.
    :param most: pixels it may have.
    :returns: (H, W) or (H, W, channels), uint8 unless the flags let it be more.
    :raises InputError: if it is no complete image of a known format, or claims too many pixels.
    """
    content = data.tobytes()
    size = claimed_size(content)
    image = None
    if size is not None:
        try:
            check_pixels(size, most)
        except InputError as error:
            raise InputError(f'{name}: {error}') from None
        jpeg = content.startswith(_JPEG)
        if jpeg and content.count(_SCAN) > _MOST_SCANS:
            raise InputError(
                f'{name} must be a JPEG of at most {_MOST_SCANS} scans, got '
                f'{content.count(_SCAN)}: write it anew'
            )
        try:
            if _holds(content, size):
                image = cv2.imdecode(data, flags)
            if jpeg and image is not None and _is_filled_up(image):
                image = None
        except cv2.error:
            # Such as of values that do not go together.
            image = None
    if image is None:
        raise InputError(f'{name} is not a complete image ({FORMATS}), got {data.size} bytes')
    return np.asarray(image)


def _holds(content: bytes, size: Size) -> bool:
    """Tell whether a JPEG or PNG holds what it claims; of others the decoder does."""
    if content.startswith(_JPEG):
        has_end = content.rfind(_END) > content.rfind(_SCAN)
        return has_end and size[0] * size[1] <= _MOST_PIXELS_PER_BYTE * len(content)
    return not content.startswith(_PNG) or _has_whole_chunks(content)


def _has_whole_chunks(content: bytes) -> bool:
    """Tell whether all chunks of a PNG are there: OpenCV 5 makes room for what they claim."""
    at = len(_PNG)
    while at + _CHUNK <= len(content):
        length, kind = struct.unpack_from('>I4s', content, at)
        at += _CHUNK + length
        if at <= len(content) and kind == b'IEND':
            return True
    return False


def _is_filled_up(image: NDArray[np.generic]) -> bool:
    """Tell whether what is missing of a JPEG, such as by a damaged size, has been made up."""
    return bool((image[-1] == _FILLED).all() and not (image == _FILLED).all())


def claimed_size(data: bytes) -> Size | None:
    """
    Return the width and height that the header of an image claims, whatever they are.

    :param data: the image, or its beginning.
    :returns: None if it is of no known format, or does not come to the size.
    """
    for start, read in _READERS.items():
        if data.startswith(start):
            try:
                return read(data)
            except struct.error:
                # The header is cut off.
                return None
    return None


def _png(data: bytes) -> Size | None:
    kind, width, height = struct.unpack_from('>4sII', data, 12)
    return (width, height) if kind == b'IHDR' else None


def _jpeg(data: bytes) -> Size | None:
    at = 2
    for _ in range(_MOST_PARTS):
        # What is between segments is passed over, as the decoder does.
        found = _FILL.search(data, at)
        if found is None:
            return None
        [marker] = struct.unpack_from('B', data, found.end())
        at = found.end() + 1
        if marker == _SCAN[1]:
            return None
        if marker in _FRAME:
            height, width = struct.unpack_from('>HH', data, at + 3)
            return width, height
        if marker not in _ALONE:
            at += struct.unpack_from('>H', data, at)[0]
    return None


def _bmp(data: bytes) -> Size | None:
    old = struct.unpack_from('<I', data, 14)[0] == 12
    width, height = struct.unpack_from('<HH' if old else '<ii', data, 18)
    # Rows from the top to the bottom have a negative height.
    return abs(width), abs(height)


def _pnm(data: bytes) -> Size | None:
    found = _PNM.match(data[: 1 << 16])
    return None if found is None else (int(found[1]), int(found[2]))


def _webp(data: bytes) -> Size | None:
    kind = data[12:16]
    if data[8:12] != b'WEBP':
        return None
    if kind == b'VP8 ':
        width, height = struct.unpack_from('<HH', data, 26)
        return width & 0x3FFF, height & 0x3FFF
    if kind == b'VP8L':
        [bits] = struct.unpack_from('<I', data, 21)
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    if kind == b'VP8X':
        width, high, height, higher = struct.unpack_from('<HBHB', data, 24)
        return (high << 16 | width) + 1, (higher << 16 | height) + 1
    return None


def _tiff(data: bytes) -> Size | None:
    order = '<' if data[:2] == b'II' else '>'
    big = 43 in data[2:4]
    [at] = struct.unpack_from(order + ('Q' if big else 'I'), data, 8 if big else 4)
    # A place beyond the end, which is also more than struct can take.
    at = min(at, len(data))
    [count] = struct.unpack_from(order + ('Q' if big else 'H'), data, at)
    at += 8 if big else 2
    found = {_WIDTH: 0, _HEIGHT: 0}
    for entry in range(min(count, _MOST_PARTS)):
        place = at + entry * (20 if big else 12)
        tag, kind = struct.unpack_from(order + 'HH', data, place)
        if tag in found and kind in _WHOLE_NUMBERS:
            value = struct.unpack_from(
                order + _WHOLE_NUMBERS[kind], data, place + (12 if big else 8)
            )[0]
            # Which of several counts is the decoder's affair.
            found[tag] = max(found[tag], value)
    return (found[_WIDTH], found[_HEIGHT]) if all(found.values()) else None


_READERS = {
    _PNG: _png,
    _JPEG: _jpeg,
    b'BM': _bmp,
    b'RIFF': _webp,
    b'II*\0': _tiff,
    b'MM\0*': _tiff,
    b'II+\0': _tiff,
    b'MM\0+': _tiff,
    **{b'P%d' % number: _pnm for number in range(1, 7)},
}
