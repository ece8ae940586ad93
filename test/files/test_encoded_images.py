# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.files.encoded_images import check_pixels, decode_image

SIZE = (64, 48)
SUFFIXES = ('.bmp', '.jpg', '.pbm', '.pgm', '.png', '.ppm', '.webp')


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
}


BEYOND = ('png, largest', 'bmp, least', 'webp')
"""What the decoders themselves do not believe."""


@pytest.mark.parametrize('kind', HUGE)
def test_a_size_that_no_camera_has_is_refused_by_the_header(kind: str) -> None:
    what = (
        'is not a complete image' if kind in BEYOND else '.* at most 67108864 pixels .* got more'
    )
    with pytest.raises(InputError, match=f'picture:? {what}'):
        decoded(HUGE[kind])


@pytest.mark.parametrize('kind', ['PF', 'Pf', 'P7', 'ras', 'tiff'])
def test_other_formats_are_refused(kind: str) -> None:
    """Of which the decoder would believe any size."""
    raster = struct.pack('>8I', 0x59A66A95, 40_000, 40_000, 24, 0, 1, 0, 0)
    known = {'ras': raster, 'tiff': b'II*\0\x08\0\0\0'}
    data = known.get(kind, kind.encode() + b'\n40000 40000\n-1.0\n')
    with pytest.raises(
        InputError, match=r'of a format that is read \(JPEG, PNG, WebP, BMP or PNM\)'
    ):
        decoded(data + bytes(50))


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_images_of_known_formats_are_decoded(suffix: str) -> None:
    data = encoded(suffix)
    assert decoded(data).shape == (*SIZE[::-1], 3)
    assert decoded(data, most=64 * 48).shape == (*SIZE[::-1], 3)
    with pytest.raises(InputError, match='at most 3071 pixels'):
        decoded(data, most=64 * 48 - 1)


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_an_image_that_is_cut_off_is_none(suffix: str) -> None:
    data = encoded(suffix)
    for length in (*range(40), len(data) // 2):
        with pytest.raises(InputError, match=f'not a complete image.*, got {length} bytes'):
            decoded(data[:length])


def test_a_jpeg_is_read_up_to_its_end_marker() -> None:
    data = encoded('.jpg')
    whole = decoded(data)
    # A thumbnail, which has an end marker of its own.
    small = data[:2] + b'\xff\xe1' + struct.pack('>H', len(data) + 2) + data + data[2:]
    for other in (data + b'more', data + data, small):
        np.testing.assert_array_equal(decoded(other), whole)
    for part in (data[:-2], data[: len(data) * 9 // 10], small[:-2]):
        with pytest.raises(InputError, match='not a complete image'):
            decoded(part)


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


def test_as_many_pixels_as_are_allowed_may_come_and_no_more() -> None:
    check_pixels((8192, 8192))
    check_pixels((4, 5), 20)
    with pytest.raises(InputError, match=r'at most 67108864 pixels .*, got 8193 x 8192'):
        check_pixels((8193, 8192))
    with pytest.raises(InputError, match=r'at most 19 pixels .*, got 4 x 5'):
        check_pixels((4, 5), 19)
