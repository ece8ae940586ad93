# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that commands write: never over what they read, never half, and with a name in errors."""

from __future__ import annotations

import os
import struct
import threading
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import ConfigError, GaitSegmentationError, SequenceError

_HEAD = 4096
"""Bytes of a file by which its kind is told."""

_PNG_HEADER = 33
"""Length of the signature of a PNG and its first part, which describes the image."""

_MARK = b'tEXtSoftware\0gait_segmentation'
"""Of the PNGs that are written here."""


def film_name(path: Path) -> str:
    """Return the name by which OpenCV finds a film: FFmpeg takes ``A:`` for a protocol."""
    # With a slash before it, it is none.
    return os.path.join('.', path)


def keep_apart(outputs: Iterable[tuple[str, Path | None]], inputs: Iterable[Path]) -> None:
    """
    Refuse outputs that would change an input.

    :param outputs: what is said of each file and folder to be written, and where it is to be,
        None if it is not wanted.
    :param inputs: files and folders that are read.
    :raises ConfigError: if an output is an input, lies in one or holds one, through links too.
    """
    # Not by Path.resolve, which some versions of Python let fail at links in a circle.
    read = [(path, Path(os.path.realpath(path))) for path in inputs]
    for name, path in outputs:
        if path is None:
            continue
        real = Path(os.path.realpath(path))
        for given, source in read:
            if real == source or (path.exists() and given.exists() and path.samefile(given)):
                how = 'is'
            elif source in real.parents:
                how = 'lies in'
            elif real in source.parents:
                how = 'holds'
            else:
                continue
            raise ConfigError(
                f'{name} {path} {how} the input {given}, which would be changed: choose another '
                'place'
            )


def keep_others(
    outputs: Iterable[tuple[str, Path | None, Callable[[bytes], bool]]], maker: str
) -> None:
    """
    Refuse outputs that would replace a file of another kind: somebody else's.

    Empty files are replaced, and what is no usual file, such as a device, is not looked at.

    :param outputs: what is said of each file to be written, where it is to be, None if it is not
        wanted, and what says of the first bytes of a file whether it is of the kind.
    :param maker: the command that makes them.
    :raises ConfigError: if there is such a file.
    """
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


def is_own_picture(head: bytes) -> bool:
    """Return whether a file begins as :func:`write_picture` writes PNGs."""
    return _MARK in head


@contextmanager
def named(path: Path | str) -> Iterator[None]:
    """Have errors of the system say what they are about: those of an open file do not."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def problem_of(error: OSError) -> str:
    """Return in words what an error of the system is about, and what is wrong."""
    reason = error.strerror or str(error)
    return reason if error.filename is None else f'{error.filename}: {reason}'


@contextmanager
def writing(path: Path, kind: type[GaitSegmentationError] = SequenceError) -> Iterator[None]:
    """
    Have errors of the system say in words that a file cannot be written.

    :raises GaitSegmentationError: of the kind.
    """
    try:
        yield
    except OSError as error:
        raise kind(f'{path} cannot be written: {error.strerror or error}') from error


def write_file(path: Path, data: bytes) -> None:
    """
    Write a file in one step: if that fails, what was there before is left, and nothing else.

    What is no usual file, such as a device, is written to.

    :raises OSError: if it cannot be written; it has a ``filename``.
    """
    with named(path):
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        part = path.with_name(f'.{path.name}.{os.getpid()}-{threading.get_ident()}.part')
        try:
            part.write_bytes(data)
            part.replace(path)
        except OSError as error:
            # It is the file asked for that matters.
            error.filename = str(path)
            raise
        finally:
            with suppress(OSError):
                part.unlink()


def write_picture(
    path: Path, image: NDArray[np.uint8], kind: type[GaitSegmentationError] = SequenceError
) -> None:
    """
    Write an image file of the format that its name says; a PNG says that it is from here.

    :raises GaitSegmentationError: of the kind, if it cannot be written.
    """
    try:
        done, data = cv2.imencode(path.suffix, image)
    except cv2.error:
        done = False
    if not done:
        raise kind(
            f'{path} cannot be written: its name must end in .png or another format OpenCV writes'
        )
    with writing(path, kind):
        write_file(path, _marked(data.tobytes()))


def _marked(data: bytes) -> bytes:
    """Return a PNG that says where it is from, and another file as it is."""
    if not data.startswith(b'\x89PNG'):
        return data
    text = _MARK[4:]
    part = struct.pack('>I', len(text)) + _MARK + struct.pack('>I', zlib.crc32(_MARK))
    return data[:_PNG_HEADER] + part + data[_PNG_HEADER:]
