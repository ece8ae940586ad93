# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import random
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.encodings import check_pixels, decode_image
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.inputs.folder import (
    IMAGE_SUFFIXES,
    images_in,
    load_image,
)

SIZE = (64, 48)


def encoded(suffix: str) -> bytes:
    """Return noise as a file of 64 x 48 pixels."""
    image = np.random.default_rng(0).integers(0, 256, (*SIZE[::-1], 3)).astype(np.uint8)
    grey = suffix in ('.pbm', '.pgm')
    # OpenCV knows files of that name by their content alone.
    suffix = '.jpg' if suffix == '.jfif' else suffix
    return cv2.imencode(suffix, image[:, :, 0] if grey else image)[1].tobytes()


def decoded(data: bytes, **options: int) -> np.ndarray:
    return decode_image(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR, name='picture', **options)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))


def _png(width: int, height: int, packed: bytes) -> bytes:
    about = struct.pack('>IIBBBBB', width, height, 8, 2, 0, 0, 0)
    parts = _chunk(b'IHDR', about) + _chunk(b'IDAT', packed) + _chunk(b'IEND', b'')
    return b'\x89PNG\r\n\x1a\n' + parts


HUGE_PNG = _png(30_000, 30_000, zlib.compress(bytes(90_001 * 100)))


@pytest.mark.parametrize(
    'names',
    [
        ['frame1.png', 'frame2.png', 'frame10.png', 'frame100.png'],
        ['1_9.png', '2_1.png', '2_10.png', '10_1.png'],
        ['7.png', '10.png', 'a1.png', 'a9.png', 'b0.png'],
        ['01.png', '1.png', '2.png'],
        ['1700000000.123456.png', '1700000000.500000.png', '1700000001.000000.png'],
    ],
)
def test_images_come_in_the_order_of_their_numbers(names: list[str], tmp_path: Path) -> None:
    for name in random.Random(0).sample([*names, '._1.png', 'notes.txt'], len(names) + 2):
        (tmp_path / name).touch()
    assert [path.name for path in images_in(tmp_path)] == names


@pytest.mark.parametrize('suffix', IMAGE_SUFFIXES)
def test_images_of_known_formats_are_decoded(suffix: str) -> None:
    assert decoded(encoded(suffix), most=64 * 48).shape == (*SIZE[::-1], 3)


def test_a_jpeg_with_bytes_behind_its_end_is_read() -> None:
    data = encoded('.jpg')
    for rest in (bytes(range(20)), b'\xff\xda' * 10, data):
        np.testing.assert_array_equal(decoded(data + rest), decoded(data))


@pytest.mark.parametrize(
    ('data', 'most'),
    [
        (b'', None),
        (b'something else', None),
        (encoded('.png')[:2000], None),
        (encoded('.jpg')[:30], None),
        (HUGE_PNG, None),
        (b'P6\n40000\n40000 255\n', None),
        (encoded('.png'), 64 * 48 - 1),
    ],
)
def test_what_is_damaged_or_too_large_is_named(
    data: bytes, most: int | None, tmp_path: Path
) -> None:
    options = {} if most is None else {'most': most}
    with pytest.raises(InputError, match='picture'):
        decoded(data, **options)
    path = tmp_path / '0.png'
    path.write_bytes(data)
    with pytest.raises(SequenceError, match=str(path)):
        load_image(path, max_pixels=most or 1 << 26)


def test_as_many_pixels_as_are_allowed_may_come_and_no_more() -> None:
    check_pixels((4, 5), 20)
    with pytest.raises(InputError, match=r'at most 19 pixels \(max_pixels\), got 4 x 5'):
        check_pixels((4, 5), 19)
