# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile messages on ``image/compressed``."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from functools import cache

import cv2
import numpy as np
from hostile.kinds import Aim, Shot, kind
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header

__all__ = ['BOMBS', 'compressed', 'png']

TOPIC = 'image/compressed'

_FORMATS = ('', 'png', 'jpg', 'bgr8; jpeg compressed bgr8', '32FC1; compressedDepth', 'h264', '{}',
            'x' * 50_000, '🙂', 'jpeg\njpeg')  # fmt: skip


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack('>I', len(data)) + name + data + struct.pack('>I', zlib.crc32(name + data))


def png(width: int, height: int, data: bytes, channels: int = 0) -> bytes:
    """
    Return a PNG that claims a size.

    :param data: the compressed rows.
    :param channels: colour type of the PNG: 0 grey, 2 RGB, 6 with alpha.
    """
    head = struct.pack('>IIBBBBB', width, height, 8, channels, 0, 0, 0)
    parts = [_chunk(b'IHDR', head), _chunk(b'IDAT', data), _chunk(b'IEND', b'')]
    return b'\x89PNG\r\n\x1a\n' + b''.join(parts)


def _jpeg(width: int, height: int) -> bytes:
    whole = bytearray(cv2.imencode('.jpg', np.zeros((8, 8), np.uint8))[1].tobytes())
    at = whole.index(b'\xff\xc0') + 5
    whole[at : at + 4] = struct.pack('>HH', height, width)
    return bytes(whole)


def _bmp(width: int, height: int) -> bytes:
    head = struct.pack('<IiiHHIIiiII', 40, width, height, 1, 24, 0, 0, 0, 0, 0, 0)
    return b'BM' + struct.pack('<IHHI', 74, 0, 0, 54) + head + bytes(20)


def _sun(width: int, height: int) -> bytes:
    size = (width * height) % 2**32
    return struct.pack('>8I', 0x59A66A95, width, height, 24, size, 1, 0, 0) + bytes(42)


def _tiff(width: int, height: int) -> bytes:
    tags = [(256, 4, width), (257, 4, height), (258, 3, 8), (259, 3, 1), (262, 3, 1),
            (273, 4, 8), (277, 3, 1), (278, 4, height), (279, 4, 4)]  # fmt: skip
    entries = b''.join(struct.pack('<HHII', tag, kind, 1, value) for tag, kind, value in tags)
    return b'II*\0' + struct.pack('<IH', 8, len(tags)) + entries + bytes(8)


def _webp(width: int, height: int) -> bytes:
    size = struct.pack('<I', width - 1)[:3] + struct.pack('<I', height - 1)[:3]
    body = b'WEBPVP8X' + struct.pack('<IB3x', 10, 0) + size + b'VP8L' + struct.pack('<I', 5)
    body += b'\x2f' + bytes(5)
    return b'RIFF' + struct.pack('<I', len(body)) + body


_HUGE = (40_000, 40_000)

BOMBS: dict[str, bytes] = {
    'PNG': png(*_HUGE, zlib.compress(bytes(50))),
    'PNG of 2^31': png(2**31 - 1, 2**31 - 1, zlib.compress(bytes(9))),
    'JPEG': _jpeg(*_HUGE),
    'BMP': _bmp(*_HUGE),
    'BMP of negative height': _bmp(40_000, -40_000),
    'BMP of 2^31': _bmp(2**31 - 1, -(2**31)),
    'PGM': b'P5\n40000 40000\n255\n' + bytes(50),
    'PPM': b'P6\n40000 40000\n255\n' + bytes(50),
    'PBM': b'P4\n40000 40000\n' + bytes(50),
    'PAM': b'P7\nWIDTH 40000\nHEIGHT 40000\nDEPTH 3\nMAXVAL 255\nTUPLTYPE RGB\nENDHDR\n'
    + bytes(9),
    'PFM': b'PF\n40000 40000\n-1.0\n' + bytes(50),
    'Sun raster': _sun(*_HUGE),
    'TIFF': _tiff(*_HUGE),
    'WebP': _webp(16_383, 16_383),
    'GIF': b'GIF89a' + struct.pack('<HHBBB', 65_535, 65_535, 0x80, 0, 0) + bytes(6) + b',;',
    'Radiance': b'#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 40000 +X 40000\n' + bytes(20),
    'JPEG 2000': bytes.fromhex('0000000c6a5020200d0a870a') + bytes(60),
    'OpenEXR': bytes.fromhex('762f3101') + struct.pack('<I', 2) + bytes(60),
}
"""Headers that claim more pixels than any camera has, by the format."""


def compressed(about: Header, data: bytes, called: str = 'jpeg') -> CompressedImage:
    """Return a message with these bytes."""
    message = CompressedImage(header=about, format=called)
    message.data.frombytes(data)
    return message


def encode(image: NDArray[np.uint8], ending: str) -> bytes:
    """Return an image as a file of the format of an ending."""
    return cv2.imencode(ending, image)[1].tobytes()


@cache
def _sea(width: int, height: int) -> bytes:
    """Return a whole PNG of many black pixels in few bytes."""
    rows = zlib.compressobj(9)
    line = bytes(width + 1)
    return png(width, height, b''.join(rows.compress(line) for _ in range(height)) + rows.flush())


def _bomb(name: str) -> None:
    @kind(f'compressed: {name} that claims too many pixels', 0.5)
    def _claims(aim: Aim) -> Iterator[Shot]:
        yield Shot(TOPIC, compressed(aim.fresh(), BOMBS[name], name.split()[0].lower()))


for _name in BOMBS:
    _bomb(_name)


@kind('compressed: PNG of 900 megapixels, whole', 0.02)
def _whole_sea(aim: Aim) -> Iterator[Shot]:
    yield Shot(TOPIC, compressed(aim.fresh(), _sea(30_000, 30_000), 'png'))


@kind('compressed: cut off')
def _cut(aim: Aim) -> Iterator[Shot]:
    data = encode(aim.image, aim.one_of(('.jpg', '.png', '.webp', '.bmp', '.tiff', '.ppm')))
    yield Shot(TOPIC, compressed(aim.fresh(), data[: int(aim.rng.integers(1, len(data)))]))


@kind('compressed: some bytes changed', 2.0)
def _changed(aim: Aim) -> Iterator[Shot]:
    small = aim.image[:64, :64]
    data = bytearray(encode(small, aim.one_of(('.jpg', '.png', '.webp', '.bmp', '.tiff', '.ppm'))))
    for at in aim.rng.integers(0, min(len(data), 400), aim.rng.integers(1, 9)):
        data[at] = aim.rng.integers(256)
    yield Shot(TOPIC, compressed(aim.fresh(), bytes(data)))


@kind('compressed: noise or nothing')
def _junk(aim: Aim) -> Iterator[Shot]:
    data = aim.noise(int(aim.rng.integers(0, 300))).tobytes()
    head = aim.one_of((b'', b'\xff\xd8\xff', b'\x89PNG\r\n\x1a\n', b'BM', b'GIF89a', b'RIFF'))
    yield Shot(TOPIC, compressed(aim.fresh(), aim.one_of((head + data, b''))))


@kind('compressed: another or no format named')
def _misnamed(aim: Aim) -> Iterator[Shot]:
    data = encode(aim.image, aim.one_of(('.jpg', '.png')))
    yield Shot(TOPIC, compressed(aim.fresh(), data, aim.one_of(_FORMATS)))


@kind('compressed: grey, with alpha, of 16 bits or of floats')
def _depths(aim: Aim) -> Iterator[Shot]:
    grey = aim.image[..., 0]
    data = aim.one_of((
        lambda: encode(grey, '.png'),
        lambda: encode(np.dstack([aim.image, grey]), '.png'),
        lambda: encode(grey.astype(np.uint16) << 8, '.png'),
        lambda: encode(aim.image.astype(np.float32) * np.nan, '.tiff'),
        lambda: encode(np.full(aim.image.shape, np.inf, np.float32), '.hdr'),
    ))()  # fmt: skip
    yield Shot(TOPIC, compressed(aim.fresh(), data))


@kind('compressed: flat, thin or of another size')
def _sizes(aim: Aim) -> Iterator[Shot]:
    width, height = aim.one_of(((1, 1), (1, 900), (900, 1), aim.size(16, 400)))
    data = encode(np.full((height, width, 3), aim.one_of((0, 255)), np.uint8), '.png')
    yield Shot(TOPIC, compressed(aim.fresh(), data, 'png'))


@kind('compressed: odd stamp', 0.5)
def _stamp(aim: Aim) -> Iterator[Shot]:
    message = compressed(aim.fresh(), encode(aim.image, '.jpg'))
    message.header.stamp.sec = aim.one_of((0, -1, 500, 2**31 - 1))
    yield Shot(TOPIC, message)


@kind('compressed: message cut off', 0.25)
def _cut_message(aim: Aim) -> Iterator[Shot]:
    data = serialize_message(compressed(aim.fresh(), encode(aim.image, '.jpg')))
    yield Shot(TOPIC, data[: int(aim.rng.integers(4, len(data)))])
