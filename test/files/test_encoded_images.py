# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.files.encoded_images import check_pixels, claimed_size, decode_image

SIZE = (64, 48)
SUFFIXES = ('.bmp', '.jpg', '.pbm', '.pgm', '.png', '.ppm', '.tiff', '.webp')


def encoded(suffix: str) -> bytes:
    """Return noise as a file of 64 x 48 pixels."""
    image = np.random.default_rng(0).integers(0, 256, (*SIZE[::-1], 3)).astype(np.uint8)
    grey = suffix in ('.pbm', '.pgm')
    return cv2.imencode(suffix, image[:, :, 0] if grey else image)[1].tobytes()


def decoded(data: bytes, **options: int) -> np.ndarray:
    return decode_image(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR, name='picture', **options)


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))


def png(width: int, height: int, packed: bytes = b'') -> bytes:
    about = struct.pack('>IIBBBBB', width, height, 8, 2, 0, 0, 0)
    parts = chunk(b'IHDR', about) + chunk(b'IDAT', packed) + chunk(b'IEND', b'')
    return b'\x89PNG\r\n\x1a\n' + parts


def jpeg(width: int, height: int) -> bytes:
    data = encoded('.jpg')
    at = data.index(b'\xff\xc0') + 5
    return data[:at] + struct.pack('>HH', height, width) + data[at + 4 :]


def bmp(width: int, height: int) -> bytes:
    about = struct.pack('<IiiHHIIiiII', 40, width, height, 1, 24, 0, 0, 0, 0, 0, 0)
    return b'BM' + struct.pack('<IHHI', 74, 0, 0, 54) + about + bytes(20)


def webp(width: int, height: int) -> bytes:
    sides = (width - 1).to_bytes(3, 'little') + (height - 1).to_bytes(3, 'little')
    return b'RIFF' + struct.pack('<I', 22) + b'WEBPVP8X' + struct.pack('<II', 10, 0) + sides


def tiff(width: int, height: int, order: str = '<', big: bool = False) -> bytes:
    """Return the beginning of a TIFF: its directory, with each side twice."""
    sides = ((256, 1), (256, width), (257, height), (257, 1))
    values = [struct.pack(order + 'HHQQ' if big else order + 'HHII', tag, 16 if big else 4, 1, n)
              for tag, n in sides]  # fmt: skip
    name = (b'II' if order == '<' else b'MM') + struct.pack(order + 'H', 43 if big else 42)
    if big:
        return name + struct.pack(order + 'HHQQ', 8, 0, 16, len(sides)) + b''.join(values)
    return name + struct.pack(order + 'IH', 8, len(sides)) + b''.join(values)


HUGE = {
    'png': png(40_000, 40_000, zlib.compress(b'x')),
    'png of zeros': png(30_000, 30_000, zlib.compress(bytes(90_001 * 100))),
    'png, largest': png(2**31 - 1, 2**31 - 1),
    'jpeg': jpeg(65_500, 65_500),
    **{f'P{kind}': b'P%d # so large\n40000\n40000 255\n' % kind for kind in range(1, 7)},
    'bmp': bmp(40_000, 40_000),
    'bmp, downwards': bmp(40_000, -40_000),
    'bmp, least': bmp(-(2**31), -(2**31)),
    'webp': webp(1 << 24, 1 << 24),
    'tiff': tiff(40_000, 40_000),
    'tiff, largest': tiff(2**32 - 1, 2**32 - 1, '>'),
    'bigtiff': tiff(2**63, 2**63, '<', big=True),
}


@pytest.mark.parametrize('kind', HUGE)
def test_a_size_that_no_camera_has_is_refused_by_the_header(kind: str) -> None:
    with pytest.raises(InputError, match=r'picture: .* at most 67108864 pixels .*, got \d+ x \d+'):
        decoded(HUGE[kind])


@pytest.mark.parametrize('kind', ['PF', 'Pf', 'P7', 'ras'])
def test_other_formats_are_refused(kind: str) -> None:
    """Of which the decoder would believe any size."""
    raster = struct.pack('>8I', 0x59A66A95, 40_000, 40_000, 24, 0, 1, 0, 0)
    data = raster if kind == 'ras' else kind.encode() + b'\n40000 40000\n-1.0\n'
    with pytest.raises(InputError, match=r'not a complete image \(PNG, JPEG, .* bytes'):
        decoded(data + bytes(50))


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_images_of_known_formats_are_decoded(suffix: str) -> None:
    data = encoded(suffix)
    assert claimed_size(data) == SIZE
    assert decoded(data).shape == (*SIZE[::-1], 3)
    assert decoded(data, most=64 * 48).shape == (*SIZE[::-1], 3)
    with pytest.raises(InputError, match='at most 3071 pixels'):
        decoded(data, most=64 * 48 - 1)


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_an_image_that_is_cut_off_is_none(suffix: str) -> None:
    data = encoded(suffix)
    for length in (*range(40), len(data) // 2):
        with pytest.raises(InputError, match=f'not a complete image .*, got {length} bytes'):
            decoded(data[:length])


def test_lossless_and_progressive_images_are_decoded() -> None:
    image = np.zeros((*SIZE[::-1], 3), np.uint8)
    for suffix, options in (
        ('.webp', [cv2.IMWRITE_WEBP_QUALITY, 60]),
        ('.jpg', [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]),
    ):
        data = cv2.imencode(suffix, image, options)[1].tobytes()
        assert claimed_size(data) == SIZE
        assert decoded(data).shape == image.shape


def test_a_jpeg_cannot_take_long_with_few_bytes() -> None:
    image = np.zeros((64, 64, 3), np.uint8)
    data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])[1].tobytes()
    last = data[data.rindex(b'\xff\xda') : -2]
    assert decoded(data[:-2] + 10 * last + data[-2:]).shape == image.shape
    with pytest.raises(InputError, match='JPEG of at most 100 scans, got'):
        decoded(data[:-2] + 100 * last + data[-2:])


def test_a_jpeg_of_few_bytes_cannot_claim_many_pixels() -> None:
    for level, progressive in ((0, 0), (128, 0), (255, 1), (128, 1)):
        flat = np.full((1024, 1024), level, np.uint8)
        options = [cv2.IMWRITE_JPEG_PROGRESSIVE, progressive, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
        data = cv2.imencode('.jpg', flat, options)[1].tobytes()
        assert flat.size > 200 * len(data)
        assert decoded(data).shape == (1024, 1024, 3)
    for width, height in ((64, 100), (320, 240), (1920, 1080), (7680, 4320)):
        with pytest.raises(InputError, match='not a complete image'):
            decoded(jpeg(width, height))


@pytest.mark.parametrize('name', [b'IDAT', b'IEND'])
def test_a_png_whose_parts_claim_more_than_comes_is_not_given_to_the_decoder(
    name: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = bytearray(encoded('.png'))
    struct.pack_into('>I', data, data.index(name) - 4, 3 << 30)
    # It would make room for them.
    monkeypatch.setattr(cv2, 'imdecode', None)
    with pytest.raises(InputError, match='not a complete image'):
        decoded(bytes(data))


@pytest.mark.parametrize(
    'data',
    [
        b'\xff\xd8' + b'\xff' * 1_000_000,
        b'\xff\xd8\xff\xe0\0\2' + b'ab' * 500_000,
        b'\xff\xd8' + b'\xff\xe0\0\2' * 500_000,
        b'\xff\xd8\xff' + b'\0\xff' * 500_000,
        b'P6' + b' ' * 1_000_000,
        b'P6' + b'#\n' * 500_000,
        b'P6 99999999999999999999 1 255 ',
        b'P6 -5 5 255 ',
        b'II*\0\xff\xff\xff\xff',
        b'II+\0\x08\0\0\0' + b'\xff' * 8,
        b'MM\0*\0\0\0\x08\xff\xff' + b'\1\1' * 500_000,
        b'RIFF\0\0\0\0WEBPVP9 ' + bytes(50),
        png(64, 48)[:12] + b'IDAT' + bytes(50),
    ],
    ids=range(13),
)
def test_a_header_without_a_size_is_none(data: bytes) -> None:
    assert claimed_size(data) is None


def test_as_many_pixels_as_are_allowed_may_come_and_no_more() -> None:
    check_pixels((8192, 8192))
    check_pixels((4, 5), 20)
    with pytest.raises(InputError, match=r'at most 67108864 pixels .*, got 8193 x 8192'):
        check_pixels((8193, 8192))
    with pytest.raises(InputError, match=r'at most 19 pixels .*, got 4 x 5'):
        check_pixels((4, 5), 19)
