# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that can be written to and are not somebody else's, and pictures."""

from __future__ import annotations

import struct
import tempfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import ConfigError, GaitSegmentationError, SequenceError
from gait_segmentation.files import write_file

_HEAD = 4096  # bytes of a file by which its kind is told
_PNG_HEADER = 33  # length of the signature of a PNG and its first part, which describes the image
SAYS = {'Software': 'gait_segmentation'}  # what PNGs say that are written here

_MARK = b'tEXtSoftware\0' + SAYS['Software'].encode()


def make_folder(option: str, folder: Path) -> None:
    """Make the folder that an option names, before what is to be written is worked out."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise ConfigError(
            f'{option} {folder}: nothing can be written: {error.strerror}'
        ) from error


def check_file(path: Path) -> None:
    """Make sure that a file can be written, before what is to be written is worked out."""
    there = path.exists()
    try:
        path.open('ab').close()
        if not there:
            path.unlink()
    except OSError as error:
        raise ConfigError(f'{path} cannot be written: {error.strerror}') from error


def keep_others(
    outputs: Iterable[tuple[str, Path | None, Callable[[bytes], bool]]], maker: str
) -> None:
    """Refuse outputs that would replace a file of another kind: (what it is, where, is it own)."""
    for name, path, is_own in outputs:
        if path is None or not path.is_file():
            continue
        with path.open('rb') as file:
            head = file.read(_HEAD)
        if head and not is_own(head):
            raise ConfigError(
                f'{name} {path} was not made by {maker} and is not replaced: remove it or choose '
                'another place'
            )


def with_part(page: Path, name: str, part: str) -> str:
    """Return a Markdown page with another part between the marks of that name."""
    try:
        head, begin, rest = page.read_text(encoding='utf-8').partition(f'<!-- {name} -->\n')
    except (OSError, ValueError) as error:
        raise ConfigError(f'{page} cannot be read: {error}') from error
    _, end, tail = rest.partition('<!-- end -->')
    if not end:
        raise ConfigError(f'{page} must have lines <!-- {name} --> and <!-- end -->')
    return f'{head}{begin}{part}{end}{tail}'


def is_own_picture(head: bytes) -> bool:
    """Return whether a file begins as :func:`write_picture` writes PNGs."""
    return _MARK in head


@contextmanager
def writing(path: Path, kind: type[GaitSegmentationError] = SequenceError) -> Iterator[None]:
    """Have errors of the system say in words that a file cannot be written."""
    try:
        yield
    except OSError as error:
        raise kind(f'{path} cannot be written: {error.strerror or error}') from error


def write_picture(
    path: Path, image: NDArray[np.uint8], kind: type[GaitSegmentationError] = SequenceError
) -> None:
    """Write an image file of the format that its name says; a PNG says that it is from here."""
    try:
        done, data = cv2.imencode(path.suffix, image)
    except cv2.error:
        done = False
    if not done:
        raise kind(
            f'{path} cannot be written: its name must end in .png or another format OpenCV writes'
        )
    written = data.tobytes()
    if written.startswith(b'\x89PNG'):
        mark = struct.pack('>I', len(_MARK) - 4) + _MARK + struct.pack('>I', zlib.crc32(_MARK))
        written = written[:_PNG_HEADER] + mark + written[_PNG_HEADER:]
    with writing(path, kind):
        write_file(path, written)
