# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Images in files and messages: which files they are, in what order, and decoding one.

OpenCV refuses what claims too many pixels before it makes room for them; it reads how many when
it is loaded, see :mod:`gait_segmentation`.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.heat_maps import heat_map_of

IMAGE_SUFFIXES = (
    *('.bmp', '.jfif', '.jpeg', '.jpg', '.pbm', '.pgm', '.png', '.ppm', '.tif', '.tiff', '.webp'),
)
"""Endings of the files taken for images."""


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
    try:
        check_pixels((image.shape[1], image.shape[0]), most)
    except InputError as error:
        raise InputError(f'{name}: {error}') from None
    return image


def _natural(path: Path) -> tuple[list[Any], str]:
    """Return a key that sorts names by the whole numbers in them: 2 before 10."""
    parts: list[Any] = re.split('([0-9]+)', path.stem)
    parts[1::2] = map(int, parts[1::2])
    return parts, path.name


def is_picture(path: Path) -> bool:
    """Return whether a path is that of one picture; an animated PNG is a film."""
    if path.suffix.lower() not in IMAGE_SUFFIXES or not path.is_file():
        return False
    if not os.access(path, os.R_OK):
        return True
    with path.open('rb') as file:
        return b'acTL' not in file.read(1 << 16).partition(b'IDAT')[0]


def images_in(folder: Path) -> list[Path]:
    """Return the images of a folder in the order of the numbers in their names."""
    files = (path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES)
    # Some systems leave a hidden ._NAME beside a file, which is no image.
    return sorted((path for path in files if not path.name.startswith('.')), key=_natural)


def read_image(
    path: Path, flags: int = cv2.IMREAD_COLOR, max_pixels: int = MOST_PIXELS
) -> NDArray[Any]:
    """
    Read an image.

    :param flags: how, as ``cv2.imdecode`` takes it.
    :param max_pixels: how many it may have.
    :returns: (H, W, 3) uint8 BGR, unless the flags ask for something else.
    :raises SequenceError: if the file is not an image that can be read, or has more pixels.
    """
    # cv2.imread says nothing of what is wrong.
    try:
        return decode_image(np.fromfile(path, np.uint8), flags, name=str(path), most=max_pixels)
    except OSError as error:
        raise SequenceError(f'{path} cannot be read: {error.strerror}') from error
    except InputError as error:
        raise SequenceError(str(error)) from error


def read_heat_map(path: Path, max_pixels: int = MOST_PIXELS) -> NDArray[np.uint8]:
    """
    Read a heat map as (h, w) uint8.

    :param max_pixels: how many it may have.
    :raises SequenceError: if it cannot be read, is in colours, or has more pixels.
    """
    try:
        return heat_map_of(read_image(path, cv2.IMREAD_UNCHANGED, max_pixels))
    except InputError as error:
        raise SequenceError(f'{path}: {error}') from error
