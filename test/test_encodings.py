# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from gait_segmentation import encodings
from gait_segmentation.encodings import (
    pixels,
    read_bgr,
    read_compressed,
    read_depth,
    read_mono8,
)
from gait_segmentation.errors import InputError
from gait_segmentation.ros.messages import image_message

BLUE, GREEN, RED = (255, 0, 0), (0, 255, 0), (0, 0, 255)


def message(data: np.ndarray, encoding: str, padding: int = 0, big: bool = False) -> Image:
    rows = data.reshape(data.shape[0], -1).view(np.uint8)
    padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    made = Image(encoding=encoding, is_bigendian=int(big))
    made.height, made.width = data.shape[:2]
    made.step = padded.shape[1]
    made.data.frombytes(np.ascontiguousarray(padded).data.cast('B'))
    return made


def plain(color: tuple[int, int, int], height: int = 6, width: int = 8) -> np.ndarray:
    image = np.empty((height, width, 3), np.uint8)
    image[:] = color
    return image


CODES = {
    'bgr': None,
    'rgb': cv2.COLOR_BGR2RGB,
    'bgra': cv2.COLOR_BGR2BGRA,
    'rgba': cv2.COLOR_BGR2RGBA,
    'mono': cv2.COLOR_BGR2GRAY,
}


@pytest.mark.parametrize(('padding', 'big'), [(0, False), (5, True)])
@pytest.mark.parametrize(
    'encoding', ['8UC3', '8UC1', *(f'{o}{n}' for o in CODES for n in (8, 16))]
)
def test_encodings_become_bgr_whatever_padding_and_byte_order(
    encoding: str, padding: int, big: bool
) -> None:
    image = np.random.default_rng(0).integers(0, 256, (6, 8, 3)).astype(np.uint8)
    if encoding in ('mono8', 'mono16', '8UC1'):
        image = np.repeat(image[..., :1], 3, axis=2)
    code = CODES.get(encoding.rstrip('816'))
    data = image if code is None else cv2.cvtColor(image, code)
    data = data[..., 0].copy() if encoding == '8UC1' else data
    if encoding.endswith('16'):
        data = ((data.astype(np.uint16) << 8) + 200).astype('>u2' if big else '<u2')
    np.testing.assert_array_equal(read_bgr(message(data, encoding, 2 * padding, big)), image)


@pytest.mark.parametrize('colour', [BLUE, GREEN, RED])
@pytest.mark.parametrize(
    ('encoding', 'order'),
    [
        ('yuv422', 'uyvy'),
        ('uyvy', 'uyvy'),
        ('yuv422_yuy2', 'yuyv'),
        ('yuyv', 'yuyv'),
        ('nv12', 'uv'),
        ('nv21', 'vu'),
    ],
)
def test_lightness_and_colour_apart_keep_the_colour(encoding, order, colour) -> None:
    y, u, v = (int(value) for value in cv2.cvtColor(plain(colour), cv2.COLOR_BGR2YUV)[0, 0])
    # Video range, as the 4:2:2 conversions take it.
    values = {'y': 16 + round(y * 219 / 255), 'u': u, 'v': v}
    if 'y' in order:
        data = np.tile(np.array([values[each] for each in order], np.uint8), (6, 4))
        made = message(data.reshape(6, 8, 2), encoding)
    else:
        data = np.tile(np.array([values[each] for each in order], np.uint8), (9, 4))
        data[:6] = values['y']
        made = message(data, encoding, 4)
        made.height = 6
    assert read_bgr(made).argmax(axis=2).tolist() == plain(colour).argmax(axis=2).tolist()


@pytest.mark.parametrize('bits', [8, 16])
@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
def test_bayer_patterns_keep_the_colour(pattern, bits) -> None:
    for colour in (BLUE, GREEN, RED):
        data = np.empty((8, 8), np.uint8)
        for place, letter in enumerate(pattern):
            data[place // 2 :: 2, place % 2 :: 2] = colour['bgr'.index(letter)]
        if bits == 16:
            data = data.astype(np.uint16) << 8
        read = read_bgr(message(data, f'bayer_{pattern}{bits}', 2))
        np.testing.assert_array_equal(read[2:-2, 2:-2], plain(colour, 4, 4))


@pytest.mark.parametrize(('padding', 'read'), [(0, read_bgr), (7, pixels)])
def test_pixels_of_8_bits_are_not_copied(padding: int, read: Any) -> None:
    made = message(plain(RED), 'bgr8', padding)
    view = read(made)
    made.data[made.step] = 9
    assert view[1, 0, 0] == 9


@pytest.mark.parametrize(('most', 'dark'), [(64 * 256 - 1, True), (64 * 256, False)])
def test_an_image_that_uses_two_bits_less_is_said_to_be_dark(most, dark, caplog) -> None:
    encodings._warn_of_darkness.cache_clear()
    encodings.in_8_bits(np.full((4, 6), most, np.uint16), '')
    assert ('nearly black' in caplog.text) == dark
    encodings._warn_of_darkness.cache_clear()


def test_the_last_row_may_lack_its_padding() -> None:
    made = message(plain(GREEN), 'bgr8', 7)
    made.data = made.data[:-7]
    np.testing.assert_array_equal(read_bgr(made), plain(GREEN))


def changed(encoding: str, shape: tuple[int, ...], lacks: int = 0, **changes: int) -> Image:
    made = message(np.zeros(shape, np.uint8), encoding)
    made.data = made.data[: len(made.data) - lacks]
    for name, value in changes.items():
        setattr(made, name, value)
    return made


@pytest.mark.parametrize(
    ('made', 'reason'),
    [
        (changed('32FC1', (6, 8, 3)), r"mono8.*got '32FC1'"),
        (changed('bgr8', (6, 8, 3), step=23), r'step must be at least 24 bytes.*got 23'),
        (changed('bgr8', (6, 8, 3), lacks=1), r'at least 144 bytes.*got 143'),
        (changed('bgr8', (6, 8, 3), height=0), 'got 8 x 0'),
        (changed('bgr8', (6, 8, 3), width=0), 'got 0 x 6'),
        (changed('yuyv', (2, 3, 2)), 'even width, got 3'),
        (changed('nv12', (5, 4), height=3), 'even height, got 3'),
        (changed('nv12', (8, 8), height=6), 'at least 72 bytes.*got 64'),
        (changed('bayer_rggb8', (2, 8)), 'at least 4 x 4'),
    ],
)
def test_what_is_no_image_is_refused(made: Image, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_bgr(made)


def test_depth_is_in_millimetres_or_metres_of_either_byte_order() -> None:
    metres = np.full((6, 8), 4.5, '>f4')
    np.testing.assert_array_equal(read_depth(message(metres, '32FC1', big=True)), metres)
    assert (read_depth(message(np.full((6, 8), 4500, np.uint16), '16UC1')) == 4500).all()


def test_a_likelihood_must_be_grey() -> None:
    with pytest.raises(InputError, match="mono8 or 8UC1, got 'bgr8'"):
        read_mono8(message(plain(RED), 'bgr8'))


@given(
    shape=st.sampled_from([(3, 5), (1, 1), (4, 2, 3), (7, 3, 3)]),
    seed=st.integers(0, 99),
    step=st.sampled_from([1, 2]),
)
def test_written_images_are_read_again(shape, seed, step) -> None:
    image = np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)[::step]
    header = Header(frame_id='camera')
    header.stamp.nanosec = seed
    made = image_message(image, header)
    assert made.header == header
    assert made.encoding == ('mono8' if image.ndim == 2 else 'bgr8')
    np.testing.assert_array_equal(pixels(made), image)
    empty = image_message(np.zeros((0, 0), np.uint8), Header())
    assert (empty.height, empty.width, len(empty.data)) == (0, 0, 0)


@pytest.mark.parametrize('encoding', ['mono16', 'bayer_rggb16', 'bgr16', 'png'])
def test_of_16_bits_the_upper_8_used_count(encoding: str) -> None:
    grey = np.full((6, 8), 2000, np.uint16)
    for bits, expected in ((16, 7), (12, 125), (10, 255)):
        if encoding == 'png':
            data = cv2.imencode('.png', grey)[1].tobytes()
            read = read_compressed(CompressedImage(format='png', data=data), bits=bits)
        else:
            image = np.dstack([grey] * 3) if encoding == 'bgr16' else grey
            read = read_bgr(message(image, encoding), bits=bits)
        assert read.dtype == np.uint8
        assert (read == expected).all()
