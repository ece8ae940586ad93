# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Image files: which they are, in what order, reading one, and a folder of them as frames."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.encodings import decode_image, in_8_bits
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.heat_maps import heat_map_of
from gait_segmentation.inputs.source import CAMERA, LOGGER, Entry, ImageSource, film_stamp_ns

IMAGE_SUFFIXES = (
    *('.bmp', '.jfif', '.jpeg', '.jpg', '.pbm', '.pgm', '.png', '.ppm', '.tif', '.tiff', '.webp'),
)
"""Endings of the files taken for images."""


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


def load_image(
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


def load_heat_map(path: Path, max_pixels: int = MOST_PIXELS) -> NDArray[np.uint8]:
    """Read a heat map, (h, w) uint8; SequenceError if it is none, or has more pixels."""
    try:
        return heat_map_of(load_image(path, cv2.IMREAD_UNCHANGED, max_pixels))
    except InputError as error:
        raise SequenceError(f'{path}: {error}') from error


class FolderSource(ImageSource):
    """An image, or a folder of them in the order of the numbers in their names; 30 a second."""

    def open(self) -> int:
        """List the images."""
        self._files = images_in(self.path) if self.path.is_dir() else [self.path]
        if not self._files:
            raise SequenceError(
                f'{self.path} holds no images ({", ".join(IMAGE_SUFFIXES)}) and no bag'
                f'{self._way_out()}'
            )
        others = Counter(
            each.suffix or each.name
            for each in (self.path.iterdir() if self.path.is_dir() else ())
            if each.suffix.lower() not in IMAGE_SUFFIXES and each.is_file()
        )
        if others:
            listed = ', '.join(f'{count} {suffix}' for suffix, count in others.items())
            LOGGER.warning('%s: skipped what is no image that is read: %s', self.path, listed)
        return len(self._files)

    def _way_out(self) -> str:
        """Return what to give instead of a folder without images."""
        inside = sorted(each for each in self.path.iterdir() if not each.name.startswith('.'))
        for each in inside:
            if each.is_dir() and os.access(each, os.R_OK) and images_in(each):
                return f': images lie one folder down, in {each}'
        return f': give each film or bag in it, such as {self.path}/*' if inside else ''

    def entries(self) -> Iterator[Entry]:
        """Yield all frames."""
        for number, path in enumerate(self._files):
            stamp_ns = film_stamp_ns(number, self.rate())
            decode = partial(_read, path, self._max_pixels, self._sample_bits)
            yield Entry(stamp_ns, stamp_ns, CAMERA, decode)


def _read(path: Path, max_pixels: int, bits: int) -> NDArray[np.uint8]:
    """Read an image of a folder; InputError if that fails, since it is of this one frame."""
    try:
        image = load_image(path, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH, max_pixels)
    except SequenceError as error:
        raise InputError(str(error)) from error
    return in_8_bits(image, str(path), bits)
