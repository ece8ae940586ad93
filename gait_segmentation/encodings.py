# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Image messages to arrays, without copies where the encoding allows it.

Anything with the fields of sensor_msgs/Image will do, a message of rclpy or one that ``rosbags``
made, so this needs no ROS.  ``cv_bridge`` is not used: its Python side breaks with NumPy 2.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import InputError
from gait_segmentation.heat_maps import heat_map_of

ImageLike: TypeAlias = Any
"""What has the fields of sensor_msgs/Image."""

CompressedImageLike: TypeAlias = Any
"""What has the fields of sensor_msgs/CompressedImage."""

_DARK_BITS = 2
"""Upper bits that are not used by the whole of an image of which they are said to be."""

_LETTERS = 40
"""Letters of a name from the wire that errors repeat."""


@dataclass(frozen=True)
class Encoding:
    """
    How the pixels of an encoding lie in memory, and the OpenCV code that makes them BGR.

    With ``chroma_rows`` half as many rows of colour follow those of lightness.
    """

    channels: int
    to_bgr: int | None
    sample_bytes: int = 1
    chroma_rows: bool = False


_UYVY = Encoding(2, cv2.COLOR_YUV2BGR_UYVY)
_YUYV = Encoding(2, cv2.COLOR_YUV2BGR_YUY2)

# OpenCV names a Bayer pattern by its second row and column, ROS by its first.
_BAYER = {
    'rggb': cv2.COLOR_BayerBG2BGR,
    'bggr': cv2.COLOR_BayerRG2BGR,
    'gbrg': cv2.COLOR_BayerGR2BGR,
    'grbg': cv2.COLOR_BayerGB2BGR,
}

ENCODINGS: dict[str, Encoding] = {
    'bgr8': Encoding(3, None),
    'rgb8': Encoding(3, cv2.COLOR_RGB2BGR),
    'bgra8': Encoding(4, cv2.COLOR_BGRA2BGR),
    'rgba8': Encoding(4, cv2.COLOR_RGBA2BGR),
    'mono8': Encoding(1, cv2.COLOR_GRAY2BGR),
    'mono16': Encoding(1, cv2.COLOR_GRAY2BGR, 2),
    '8UC1': Encoding(1, cv2.COLOR_GRAY2BGR),
    '8UC3': Encoding(3, None),
    'yuv422': _UYVY,
    'uyvy': _UYVY,
    'yuv422_yuy2': _YUYV,
    'yuyv': _YUYV,
    'nv12': Encoding(1, cv2.COLOR_YUV2BGR_NV12, chroma_rows=True),
    'nv21': Encoding(1, cv2.COLOR_YUV2BGR_NV21, chroma_rows=True),
    'bgr16': Encoding(3, None, 2),
    'rgb16': Encoding(3, cv2.COLOR_RGB2BGR, 2),
    'bgra16': Encoding(4, cv2.COLOR_BGRA2BGR, 2),
    'rgba16': Encoding(4, cv2.COLOR_RGBA2BGR, 2),
    **{f'bayer_{pattern}8': Encoding(1, code) for pattern, code in _BAYER.items()},
    **{f'bayer_{pattern}16': Encoding(1, code, 2) for pattern, code in _BAYER.items()},
}
"""The encodings that can be read; 8UC3 is taken for BGR, and of 16 bits the upper 8 used are."""

_FLOATS = Encoding(1, None, 4)
"""``32FC1``, which no image of a camera has: heat maps and depths."""


def check_pixels(size: tuple[int, int], most: int = MOST_PIXELS, where: str = '') -> None:
    """
    Refuse image sizes from messages and files that no camera has.

    :param size: width and height.
    :param most: pixels there may be.
    :param where: what errors begin with.
    :raises InputError: if there are more.
    """
    if size[0] * size[1] > most:
        raise InputError(
            f'{where}image must have at most {most} pixels (max_pixels), got {size[0]} x {size[1]}'
        )


def decode_image(
    data: NDArray[np.uint8], flags: int, *, name: str, most: int = MOST_PIXELS
) -> NDArray[Any]:
    """
    Decode an image.

    :param data: (n,) uint8, the contents of the file or message.
    :param flags: how, as ``cv2.imdecode`` takes it.
    :param name: what errors call the image.
    :param most: pixels it may have.
    :returns: (H, W) or (H, W, channels), uint8 unless the flags let it be more.
    :raises InputError: if it cannot be decoded, or claims too many pixels.
    """
    try:
        image = cv2.imdecode(data, flags) if data.size else None
    except cv2.error as error:
        if 'CV_IO_MAX_IMAGE' in str(error):
            raise InputError(
                f'{name} has more pixels than OPENCV_IO_MAX_IMAGE_PIXELS allows'
            ) from None
        image = None
    if image is None:
        raise InputError(
            f'{name} is not a complete image that OpenCV decodes, got {data.size} bytes'
        )
    check_pixels((image.shape[1], image.shape[0]), most, f'{name}: ')
    return image


def upper_bits(samples: NDArray[np.uint16], bits: int = 16) -> NDArray[np.uint8]:
    """
    Return the upper 8 of the bits that an image of 16 uses, any shape.

    :param bits: of a sample that the camera uses, 8 to 16: some send 10, 12 or 14 as 16, the upper
        ones zero.
    """
    upper = np.minimum(samples >> (bits - 8), 255).astype(np.uint8)
    if upper.max(initial=0) < 1 << (8 - _DARK_BITS):
        _warn_of_darkness(bits)
    return upper


@cache
def _warn_of_darkness(bits: int) -> None:
    """Say once what may be wrong with images that use less than the bits they are said to."""
    logging.getLogger('gait_segmentation').warning(
        'an image of 16 bits is nearly black if %d of them are used: sample_bits (--sample-bits) '
        'says how many the camera uses, such as 10 or 12',
        bits,
    )


def in_8_bits(image: NDArray[Any], name: str, bits: int = 16) -> NDArray[np.uint8]:
    """Return an image in 8 bits, see :func:`upper_bits`; InputError if it has neither 8 nor 16."""
    if image.dtype == np.uint16:
        return upper_bits(image, bits)
    if image.dtype != np.uint8:
        raise InputError(f'{name} must have 8 or 16 bits, got {image.dtype}')
    return image


def pixels(message: ImageLike, most: int = MOST_PIXELS) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """
    View the pixels of a message as they are encoded, without copying them.

    The array aliases the message: copy it before you draw on it.

    :param most: pixels it may have.
    :returns: (height, width) or (height, width, channels), uint8, or uint16 in the byte order of
        the message where a sample has two bytes; half as many rows more for ``nv12`` and ``nv21``.
    :raises InputError: if the encoding is unknown, the size zero or too large, ``step`` too small
        for a row or the data too short.
    """
    encoding = ENCODINGS.get(message.encoding)
    if encoding is None:
        raise InputError(
            f'image encoding must be one of {", ".join(ENCODINGS)}, got '
            f'{message.encoding[:_LETTERS]!r}'
        )
    return _samples(message, encoding, 'u', most)


def _samples(message: ImageLike, encoding: Encoding, kind: str, most: int) -> NDArray[Any]:
    """View the samples of a message, which are unsigned (u) or floating point numbers (f)."""
    height, width, step = message.height, message.width, message.step
    if height == 0 or width == 0:
        raise InputError(f'image must have at least one pixel, got {width} x {height}')
    check_pixels((width, height), most)
    pixel = encoding.channels * encoding.sample_bytes
    if step < width * pixel:
        raise InputError(
            f'image step must be at least {width * pixel} bytes for {width} pixels of '
            f'{message.encoding}, got {step}'
        )
    rows = height + (height + 1) // 2 if encoding.chroma_rows else height
    # Some drivers leave out the padding behind the last row.
    needed = step * (rows - 1) + width * pixel
    if len(message.data) < needed:
        raise InputError(
            f'image data must have at least {needed} bytes for {width} x {height} pixels of '
            f'{message.encoding} with step {step}, got {len(message.data)}'
        )
    data = np.frombuffer(message.data, np.uint8)
    order = '>' if message.is_bigendian else '<'
    sample = np.dtype(f'{order}{kind}{encoding.sample_bytes}')
    shape, strides = (rows, width, encoding.channels), (step, pixel, encoding.sample_bytes)
    axes = 2 if encoding.channels == 1 else 3
    return np.ndarray(shape[:axes], sample, data.data, 0, strides[:axes])


def read_bgr(message: ImageLike, most: int = MOST_PIXELS, bits: int = 16) -> NDArray[np.uint8]:
    """
    Read an image of any supported encoding as BGR.

    :param most: pixels it may have.
    :param bits: that samples of 16 use, see :func:`upper_bits`.
    :returns: (height, width, 3) uint8, contiguous; an alias of the message where it is
        ``bgr8`` without padding.
    :raises InputError: see :func:`pixels`; also if the size does not suit the encoding.
    """
    view = pixels(message, most)
    encoding = ENCODINGS[message.encoding]
    if encoding.sample_bytes == 2:
        view = upper_bits(view.astype(np.uint16, copy=False), bits)
    if encoding.to_bgr is None:
        return np.ascontiguousarray(view)
    if (encoding.channels == 2 or encoding.chroma_rows) and message.width % 2:
        raise InputError(f'{message.encoding} needs an even width, got {message.width}')
    if encoding.chroma_rows and message.height % 2:
        raise InputError(f'{message.encoding} needs an even height, got {message.height}')
    if message.encoding.startswith('bayer') and min(message.width, message.height) < 4:
        raise InputError(
            f'{message.encoding} needs at least 4 x 4 pixels, got '
            f'{message.width} x {message.height}'
        )
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(view), encoding.to_bgr))


def read_mono8(message: ImageLike) -> NDArray[np.uint8]:
    """
    Read a likelihood, a mask or a shape prior.

    :returns: (height, width) uint8, contiguous, an alias of the message where it has no padding.
    :raises InputError: see :func:`pixels`; also if the image is not ``mono8`` or ``8UC1``.
    """
    if message.encoding not in ('mono8', '8UC1'):
        raise InputError(
            f'image encoding must be mono8 or 8UC1, got {message.encoding[:_LETTERS]!r}'
        )
    return np.ascontiguousarray(pixels(message))


def read_heat_map(message: ImageLike, most: int = MOST_PIXELS) -> NDArray[np.uint8]:
    """
    Read a heat map of ``mono8``, ``8UC1``, ``mono16`` or ``32FC1`` (0..1).

    :param most: pixels it may have.
    :returns: (height, width) uint8, contiguous.
    :raises InputError: see :func:`pixels` and :func:`heat_map_of`.
    """
    if message.encoding == '32FC1':
        return heat_map_of(_samples(message, _FLOATS, 'f', most))
    if message.encoding not in ('mono8', '8UC1', 'mono16'):
        raise InputError(
            'heat map encoding must be mono8, 8UC1, mono16 or 32FC1, got '
            f'{message.encoding[:_LETTERS]!r}'
        )
    return heat_map_of(pixels(message, most))


def read_compressed(
    message: CompressedImageLike, most: int = MOST_PIXELS, bits: int = 16
) -> NDArray[np.uint8]:
    """
    Decode a compressed image, such as a JPEG or PNG.

    :param most: pixels it may have.
    :param bits: that samples of 16 use, see :func:`upper_bits`.
    :returns: (height, width, 3) uint8 BGR.
    :raises InputError: if it cannot be decoded, or claims more pixels.
    """
    name = f'compressed image of format {message.format[:_LETTERS]!r}'
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION | cv2.IMREAD_ANYDEPTH
    image = decode_image(np.frombuffer(message.data, np.uint8), flags, name=name, most=most)
    return in_8_bits(image, name, bits)


def read_image(message: Any, most: int = MOST_PIXELS, bits: int = 16) -> NDArray[np.uint8]:
    """Return a raw or compressed image; see :func:`read_bgr` and :func:`read_compressed`."""
    read = read_bgr if hasattr(message, 'encoding') else read_compressed
    return read(message, most, bits)


def claimed_shape(message: ImageLike) -> tuple[int, int] | None:
    """
    Return (height, width) that an image claims to have, None if it says nothing sensible.

    A size is only accepted with as many bytes as pixels: empty answers are made of it.  Compressed
    images claim none.
    """
    if not hasattr(message, 'height'):
        return None
    shape = (message.height, message.width)
    return shape if 0 < shape[0] * shape[1] <= min(MOST_PIXELS, len(message.data)) else None


def read_depth(
    message: ImageLike, most: int = MOST_PIXELS
) -> NDArray[np.uint16] | NDArray[np.float32]:
    """
    View a depth image of ``16UC1``, ``mono16`` or ``32FC1``, without copying it if it can be.

    :param most: pixels it may have.
    :returns: (height, width) uint16 in millimetres or float32 in metres.
    :raises InputError: see :func:`pixels`.
    """
    if message.encoding == '32FC1':
        view = _samples(message, _FLOATS, 'f', most)
    elif message.encoding in ('16UC1', 'mono16'):
        view = _samples(message, Encoding(1, None, 2), 'u', most)
    else:
        raise InputError(
            'its encoding must be one of 16UC1, mono16, 32FC1, got '
            f'{message.encoding[:_LETTERS]!r}'
        )
    return view.astype(view.dtype.newbyteorder('='), copy=False)
