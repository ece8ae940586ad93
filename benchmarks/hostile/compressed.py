# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile messages on ``image/compressed``."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from functools import cache

import cv2
import numpy as np
from hostile.kinds import Aim, Shot, kind
from hostile.messages import kinds_of_fields
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header

__all__ = ['compressed', 'encode']

TOPIC = 'image/compressed'
_ENDINGS = ('.jpg', '.png', '.webp', '.bmp', '.tiff', '.ppm')


def compressed(about: Header, data: bytes) -> CompressedImage:
    """Return a message with these bytes."""
    message = CompressedImage(header=about, format='jpeg')
    message.data.frombytes(data)
    return message


def encode(image: NDArray[np.generic], ending: str) -> bytes:
    """Return an image as a file of the format of an ending."""
    return cv2.imencode(ending, image)[1].tobytes()


def _png(width: int, height: int, data: bytes = b'') -> bytes:
    """Return a grey PNG that claims a size; ``data`` are its compressed rows."""
    head = struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)
    chunks = (b'IHDR' + head, b'IDAT' + (data or zlib.compress(bytes(50))), b'IEND')
    return b'\x89PNG\r\n\x1a\n' + b''.join(
        struct.pack('>I', len(each) - 4) + each + struct.pack('>I', zlib.crc32(each))
        for each in chunks
    )


def _claiming(ending: str, form: str, at: int, *size: int) -> bytes:
    """Return a small image that claims another size, which is at a place of its header."""
    data = bytearray(encode(np.zeros((8, 8, 3), np.uint8), ending))
    if ending == '.jpg':
        at += data.index(b'\xff\xc0')
    struct.pack_into(form, data, at, *size)
    return bytes(data)


_SIDE = 40_000
_TIFF = b'II*\0' + struct.pack('<IH', 8, 2) + b''.join(
    struct.pack('<HHII', tag, 4, 1, _SIDE) for tag in (256, 257)
) + bytes(8)  # fmt: skip

BOMBS: dict[str, bytes] = {
    'PNG': _png(_SIDE, _SIDE),
    'PNG of 2^31': _png(2**31 - 1, 2**31 - 1),
    'JPEG': _claiming('.jpg', '>HH', 5, _SIDE, _SIDE),
    'JPEG of 64 megapixels': _claiming('.jpg', '>HH', 5, 8190, 8190),
    'JPEG of 32 megapixels': _claiming('.jpg', '>HH', 5, 4320, 7680),
    'BMP': _claiming('.bmp', '<ii', 18, _SIDE, _SIDE),
    'BMP of 2^31, upside down': _claiming('.bmp', '<ii', 18, 2**31 - 1, -(2**31)),
    'BMP of 64 megapixels': _claiming('.bmp', '<ii', 18, 8190, 8190),
    'PNM': b'P6\n40000 40000\n255\n' + bytes(50),
    'PNM of 64 megapixels': b'P5\n8190 8190\n255\n' + bytes(50),
    'TIFF': _TIFF,
    'WebP': _claiming('.webp', '<HH', 26, 16_383, 16_383),
    'GIF': b'GIF89a' + struct.pack('<HHBBB', 65_535, 65_535, 0x80, 0, 0) + bytes(6) + b',;',
    'Radiance': b'#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 40000 +X 40000\n' + bytes(20),
    'PAM': b'P7\nWIDTH 40000\nHEIGHT 40000\nDEPTH 3\nMAXVAL 255\nENDHDR\n' + bytes(9),
    'Sun raster': struct.pack('>8I', 0x59A66A95, _SIDE, _SIDE, 24, 0, 1, 0, 0) + bytes(42),
    'JPEG 2000': bytes.fromhex('0000000c6a5020200d0a870a') + bytes(60),
    'OpenEXR': bytes.fromhex('762f3101') + struct.pack('<I', 2) + bytes(60),
}
"""Headers that claim more pixels than any camera has, or than come, by the format."""


@cache
def _sea() -> bytes:
    """Return a whole PNG of 900 megapixels, all black, in few bytes."""
    rows, line = zlib.compressobj(9), bytes(30_001)
    return _png(30_000, 30_000, b''.join(rows.compress(line) for _ in line[1:]) + rows.flush())


def _odd(aim: Aim) -> tuple[NDArray[np.generic], str]:
    """Return an image that is grey, with alpha, of other numbers, flat, thin or odd in size."""
    grey = aim.image[..., 0]
    width, height = aim.one_of(((1, 1), (1, 900), (900, 1), aim.size(16, 400)))
    return aim.one_of((
        (grey, '.png'),
        (np.dstack([aim.image, grey]), '.png'),
        (grey.astype(np.uint16) << 8, '.png'),
        (np.full(aim.image.shape, np.nan, np.float32), '.tiff'),
        (np.full(aim.image.shape, np.inf, np.float32), '.hdr'),
        (np.full((height, width, 3), aim.one_of((0, 255)), np.uint8), '.png'),
    ))  # fmt: skip


def _resized(aim: Aim) -> bytes:
    data = bytearray(encode(aim.image, '.jpg'))
    struct.pack_into('>HH', data, data.index(b'\xff\xc0') + 5, *aim.size(1, 65_535))
    return bytes(data)


def _any(aim: Aim, side: int = 400) -> bytes:
    return encode(aim.image[:side, :side], aim.one_of(_ENDINGS))


_HEADS = (b'', b'\xff\xd8\xff', b'\x89PNG\r\n\x1a\n', b'BM', b'GIF89a', b'RIFF')
_DATA: dict[str, tuple[Callable[[Aim], bytes], float]] = {
    'PNG of 900 megapixels, whole': (lambda aim: _sea(), 0.02),
    'cut off': (lambda aim: aim.cut(_any(aim)), 2.0),
    'some bytes changed': (lambda aim: aim.some_changed(_any(aim, 64), 0, 400), 4.0),
    'size changed': (_resized, 2.0),
    'noise or nothing': (lambda aim: aim.one_of(_HEADS) + aim.noise(aim.size()[0]).tobytes(), 1.0),
    'odd image': (lambda aim: encode(*_odd(aim)), 2.0),
} | {f'{name}, claimed': (lambda aim, data=data: data, 0.5) for name, data in BOMBS.items()}
for _name, (_make, _weight) in _DATA.items():
    kind(f'compressed: {_name}', _weight)(
        lambda aim, make=_make: iter([Shot(TOPIC, compressed(aim.fresh(), make(aim)))])
    )
kinds_of_fields(
    'compressed',
    CompressedImage(),
    lambda aim, change: iter([Shot(TOPIC, change(compressed(aim.fresh(), _any(aim))))]),
)


@kind('compressed: message cut off', 0.25)
def _cut_message(aim: Aim) -> Iterator[Shot]:
    yield Shot(TOPIC, aim.cut(serialize_message(compressed(aim.fresh(), _any(aim)))))
