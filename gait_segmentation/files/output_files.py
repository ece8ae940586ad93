# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that commands write: never over what they read, never half, and with a name in errors."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gait_segmentation.errors import ConfigError


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
    read = [(path, path.resolve()) for path in inputs]
    for name, path in outputs:
        if path is None:
            continue
        real = path.resolve()
        for given, source in read:
            if real == source or (path.exists() and given.exists() and path.samefile(given)):
                how = 'is'
            elif source in real.parents or real in source.parents:
                how = 'lies in' if source in real.parents else 'holds'
            else:
                continue
            raise ConfigError(
                f'{name} {path} {how} the input {given}, which would be changed: choose another '
                'place'
            )


@contextmanager
def named(path: Path | str) -> Iterator[None]:
    """Have errors of the system say what they are about: those of an open file do not."""
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def problem_of(error: OSError) -> str:
    """Return in words what an error of the system is about, and what is wrong."""
    reason = error.strerror or str(error)
    return reason if error.filename is None else f'{error.filename}: {reason}'


def write_file(path: Path, data: bytes) -> None:
    """
    Write a file in one step: if that fails, what was there before is left, and nothing else.

    :raises OSError: if it cannot be written; it has a ``filename``.
    """
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')
    try:
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        # It is the file asked for that matters.
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        part.unlink(missing_ok=True)
