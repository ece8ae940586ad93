# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile messages on ``image``."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

import numpy as np
from hostile.kinds import BAD, Aim, Shot, header, kind
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image

from gait_segmentation.inputs.encodings import ENCODINGS
from gait_segmentation.ros.image import image_message

__all__ = ['LIARS', 'encoded', 'liar']

_UNKNOWN = (
    '', ' ', 'BGR8', 'bgr8 ', '16UC1', '32FC1', '64FC4', 'jpeg', 'rgb8; jpeg compressed bgr8',
    'h264', '{}', '%s%n', 'bgr8\nbgr8', '\x1b[31mbgr8', 'schwarzweiß', '🙂', 'a' * 20_000,
)  # fmt: skip
_FRAME_IDS = (
    '',
    '/',
    'a' * 100_000,
    '{0}',
    '%s%n',
    'a\nb',
    '\x1b[2J',
    '🙂' * 50,
    '\u202e',
    "';--",
)


def encoded(aim: Aim, encoding: str, width: int, height: int) -> Image:
    """Return noise that is as its fields say."""
    about = ENCODINGS[encoding]
    rows = height + (height + 1) // 2 if about.chroma_rows else height
    step = width * about.channels * about.sample_bytes
    message = Image(header=aim.fresh(), height=height, width=width, encoding=encoding, step=step)
    message.data.frombytes(aim.noise(rows * step).tobytes())
    return message


def _any(aim: Aim, least: int = 1) -> Image:
    return encoded(aim, aim.one_of(ENCODINGS), *aim.size(least))


def _alter(message: Image, **fields: int | str) -> Image:
    for name, value in fields.items():
        setattr(message, name, value)
    return message


LIARS: dict[str, Callable[[Image], Image]] = {
    'data of no bytes': lambda m: _alter(m, data=[]),
    'data short of a byte': lambda m: _alter(m, data=m.data[:-1]),
    'step zero': lambda m: _alter(m, step=0),
    'step short of a byte': lambda m: _alter(m, step=m.step - 1),
    'step of 4 GB': lambda m: _alter(m, step=2**32 - 1),
    'no width': lambda m: _alter(m, width=0),
    'no height': lambda m: _alter(m, height=0),
    '8192 x 8192 claimed': lambda m: _alter(m, data=[], width=8192, height=8192, step=8192),
    '8192 x 8193 claimed': lambda m: _alter(m, data=[], width=8192, height=8193, step=8192),
    '2^32 x 2^32 claimed': lambda m: _alter(m, width=2**32 - 1, height=2**32 - 1),
    '1 x 2^32 claimed': lambda m: _alter(m, width=1, height=2**32 - 1, step=1),
    'byte order of 77': lambda m: _alter(m, is_bigendian=77),
}
"""What makes an image say of itself what is not so, by what that is."""


def liar(how: str, topic: str = 'image') -> None:
    """Enter a kind of images that say what is not so."""

    @kind(f'image: {how}')
    def _lie(aim: Aim) -> Iterator[Shot]:
        yield Shot(topic, LIARS[how](_any(aim)))


for _how in LIARS:
    liar(_how)


@kind('image: noise in any encoding')
def _noise(aim: Aim) -> Iterator[Shot]:
    yield Shot('image', _any(aim))


@kind('image: bayer or yuv of odd size')
def _odd(aim: Aim) -> Iterator[Shot]:
    width, height = aim.size(1, 9)
    names = [name for name in ENCODINGS if name.startswith(('bayer', 'yuv', 'uyvy', 'nv', 'yuyv'))]
    yield Shot('image', encoded(aim, aim.one_of(names), width | 1, height | 1))


@kind('image: unknown encoding')
def _unknown(aim: Aim) -> Iterator[Shot]:
    yield Shot('image', _alter(_any(aim), encoding=aim.one_of(_UNKNOWN)))


@kind('image: depth of NaN')
def _depth(aim: Aim) -> Iterator[Shot]:
    width, height = aim.size()
    message = Image(
        header=aim.fresh(), height=height, width=width, encoding='32FC1', step=4 * width
    )
    message.data.frombytes(np.full((height, width), np.nan, np.float32).tobytes())
    yield Shot('image', message)


@kind('image: another encoding than the data are in')
def _mistaken(aim: Aim) -> Iterator[Shot]:
    yield Shot('image', _alter(_any(aim), encoding=aim.one_of(ENCODINGS)))


@kind('image: padded rows or data behind the last')
def _padded(aim: Aim) -> Iterator[Shot]:
    width, height = aim.size()
    padded = aim.noise(height + 3, 3 * width + int(aim.rng.integers(1, 70)))
    message = image_message(padded, aim.fresh())
    yield Shot('image', _alter(message, encoding='bgr8', width=width, height=height))


@kind('image: thin')
def _thin(aim: Aim) -> Iterator[Shot]:
    width, height = aim.one_of(((1, 1), (1, 3000), (3000, 1), (2, 2), (3, 500), (15, 15)))
    yield Shot('image', image_message(aim.noise(height, width, 3), aim.fresh()))


@kind('image: flat')
def _flat(aim: Aim) -> Iterator[Shot]:
    flat = np.full_like(aim.image, aim.one_of((0, 1, 127, 254, 255)))
    for _ in range(3):
        yield Shot('image', image_message(flat, aim.fresh()))


@kind('image: half of it saturated')
def _saturated(aim: Aim) -> Iterator[Shot]:
    image = aim.image.copy()
    image[: aim.rng.integers(image.shape[0])] = aim.one_of((0, 255))
    yield Shot('image', image_message(image, aim.fresh()))


@kind('image: somebody before a flat wall')
def _wall(aim: Aim) -> Iterator[Shot]:
    for step in range(3):
        wall = np.full_like(aim.image, 255)
        wall[30:150, 80 + 6 * step : 120 + 6 * step] = 40
        yield Shot('image', image_message(wall, aim.fresh()))


@kind('image: the one before')
def _repeated(aim: Aim) -> Iterator[Shot]:
    for _ in range(2):
        yield Shot('image', aim.picture())


@kind('image: checkered or striped')
def _checkered(aim: Aim) -> Iterator[Shot]:
    rows, columns = np.indices(aim.image.shape[:2])
    along = aim.one_of((rows, columns, rows + columns))
    image = np.repeat((255 * (along % 2)).astype(np.uint8)[..., None], 3, axis=2)
    yield Shot('image', image_message(image, aim.fresh()))


@kind('image: noise of the same size')
def _same_size(aim: Aim) -> Iterator[Shot]:
    yield Shot('image', image_message(aim.noise(*aim.image.shape), aim.fresh()))


@kind('image: of another size', 0.3)
def _another_size(aim: Aim) -> Iterator[Shot]:
    width, height = aim.size(16, 640)
    yield Shot('image', image_message(aim.noise(height, width, 3), aim.fresh()))


_STAMPS: dict[str, Callable[[Aim], tuple[int, int]]] = {
    'zero': lambda aim: (0, 0),
    'negative': lambda aim: (aim.one_of((-1, -5, -(2**31))), 7),
    'back by seconds': lambda aim: (aim.stamp_ns // 10**9 - int(aim.rng.integers(1, 900)), 3),
    'of year 2038': lambda aim: (2**31 - 1, 999_999_999),
    'of the good frame before': lambda aim: divmod(aim.stamp_ns, 10**9),
    'with 2^32 nanoseconds': lambda aim: (aim.stamp_ns // 10**9, 2**32 - 1),
}


def _stamped(how: str) -> None:
    @kind(f'image: stamp {how}', 0.5)
    def _stamp(aim: Aim) -> Iterator[Shot]:
        message = aim.picture()
        message.header.stamp.sec, message.header.stamp.nanosec = _STAMPS[how](aim)
        yield Shot('image', message)


for _how in _STAMPS:
    _stamped(_how)


@kind('image: odd or long frame_id')
def _frame_id(aim: Aim) -> Iterator[Shot]:
    message = aim.picture()
    message.header.frame_id = aim.one_of(_FRAME_IDS)
    yield Shot('image', message)


# As no publisher of ROS makes them.  Seldom, since Fast DDS prints a line of each that it cannot
# read.


@kind('bytes: cut off', 0.25)
def _cut(aim: Aim) -> Iterator[Shot]:
    data = serialize_message(_any(aim))
    yield Shot('image', data[: int(aim.rng.integers(4, len(data)))])


@kind('bytes: some changed', 0.25)
def _changed(aim: Aim) -> Iterator[Shot]:
    data = bytearray(serialize_message(_any(aim)))
    # Behind what says how the rest is to be read, in the part that says what it is.
    for at in aim.rng.integers(4, min(len(data), 64), 3):
        data[at] = aim.rng.integers(256)
    # Not to be taken for a good one.
    data[12:16] = struct.pack('<I', len(BAD) + 1)
    yield Shot('image', bytes(data))


@kind('bytes: a frame_id that is no UTF-8')
def _no_utf8(aim: Aim) -> Iterator[Shot]:
    message = image_message(aim.image, header(aim.fresh().stamp.sec * 10**9 + 5, 'xxx'))
    yield Shot('image', serialize_message(message).replace(b'xxx', b'\xff\xfe\xc3', 1))


@kind('bytes: data of 4 GB announced', 0.25)
def _announced(aim: Aim) -> Iterator[Shot]:
    message = image_message(aim.noise(4, 4), aim.fresh())
    data = serialize_message(message)
    yield Shot('image', data.replace(struct.pack('<I', 16), struct.pack('<I', 2**32 - 1), 1))
