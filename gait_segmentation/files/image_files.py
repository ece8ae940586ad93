# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files with images: which they are, in what order they are frames, and reading one."""

from __future__ import annotations

import re
from decimal import Decimal
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files.encoded_images import decode_image
from gait_segmentation.files.reading import regular
from gait_segmentation.heat_maps import heat_map_of

IMAGE_SUFFIXES = ('.bmp', '.jpeg', '.jpg', '.pbm', '.pgm', '.png', '.ppm', '.webp')
"""Endings of the files taken for images."""

_NUMBER = re.compile(r'((?:^-)?\d+(?:\.\d+)*(?:e[-+]\d{1,3})?)')
"""A number in a name, such as 12, -0.5 or 1e-05, or several with points, as in dates."""


def by_number(path: Path) -> tuple[list[str | tuple[Decimal, ...]], str]:
    """Return a key that sorts names by the numbers in them: 2 before 10, and 0.25 before 0.5."""
    parts: list[Any] = _NUMBER.split(path.stem)
    # Every second part is a number.
    for index, number in enumerate(parts[1::2]):
        each = [number] if number.count('.') < 2 else number.split('.')
        parts[2 * index + 1] = tuple(map(Decimal, each))
    return parts, path.name


def images_in(folder: Path) -> list[Path]:
    """Return the images of a folder in the order of the numbers in their names."""
    files = (path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES)
    # Some systems leave a hidden ._NAME beside a file, which is no image.
    return sorted((path for path in files if not path.name.startswith('.')), key=by_number)


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
    # Not by cv2.imread, which crashes at names that are not UTF-8.
    try:
        data = np.fromfile(regular(path), dtype=np.uint8)
    except OSError as error:
        raise SequenceError(f'{path} cannot be read: {error.strerror}') from error
    try:
        return decode_image(data, flags, name=str(path), most=max_pixels)
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
