# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Decoding images of the formats that cameras and people send, if they are whole.

OpenCV refuses what claims too many pixels before it makes room for them; it reads how many when
it is loaded, see :mod:`gait_segmentation`.
"""

from __future__ import annotations

import re
import struct

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import InputError

FORMATS = 'JPEG, PNG, WebP, BMP or PNM'
"""What is decoded; OpenCV knows more, which no camera sends and nobody's masks are in."""

_JPEG, _PNG = b'\xff\xd8\xff', b'\x89PNG\r\n\x1a\n'
_BEGINNING = re.compile(
    b'|'.join((re.escape(_JPEG), re.escape(_PNG), rb'RIFF....WEBP', rb'BM', rb'P[1-6][\s#]')),
    re.DOTALL,
)
_CHUNK = 12
"""Bytes of a PNG's chunk beside its data: length, kind and checksum."""

_SCAN, _END = b'\xff\xda', b'\xff\xd9'


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


def is_image(data: bytes) -> bool:
    """Return whether data begin like an image of one of the :data:`FORMATS`."""
    return _BEGINNING.match(data) is not None


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
    :raises InputError: if it is not whole, of another format, or claims too many pixels.
    """
    content = data.tobytes()
    if not is_image(content):
        raise InputError(
            f'{name} is not a complete image of a format that is read ({FORMATS}), got '
            f'{len(content)} bytes'
        )
    image = None
    if content.startswith(_JPEG):
        # What is missing the decoder fills up with grey.
        whole = content.rfind(_END) > content.rfind(_SCAN)
    else:
        whole = not content.startswith(_PNG) or _has_whole_chunks(content)
    if whole:
        image = _decoded(content, flags, name, most)
    if image is None:
        raise InputError(f'{name} is not a complete image, got {len(content)} bytes')
    try:
        check_pixels((image.shape[1], image.shape[0]), most)
    except InputError as error:
        raise InputError(f'{name}: {error}') from None
    return image


def _decoded(content: bytes, flags: int, name: str, most: int) -> NDArray[np.uint8] | None:
    try:
        return cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    except cv2.error as error:
        if 'CV_IO_MAX_IMAGE' not in str(error):
            # Such as of values that do not go together.
            return None
        raise InputError(
            f'{name}: image must have at most {most} pixels (max_pixels), and as many as the '
            'variable OPENCV_IO_MAX_IMAGE_PIXELS says, got more'
        ) from None


def _has_whole_chunks(content: bytes) -> bool:
    """Tell whether all chunks of a PNG are there: OpenCV 5 makes room for what they claim."""
    at = len(_PNG)
    while at + _CHUNK <= len(content):
        length, kind = struct.unpack_from('>I4s', content, at)
        at += _CHUNK + length
        if at <= len(content) and kind == b'IEND':
            return True
    return False
