# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files: what is installed, YAML that people write, and outputs, never over an input or half."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, MutableMapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from gait_segmentation.errors import ConfigError, GaitSegmentationError

_PROFILE = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


def shared_file(name: str) -> Path:
    """
    Return the path of a file such as ``config/fastdds_shm.xml``.

    Looked for in the ament prefixes (colcon), in the Python prefix (pip) and beside the package
    (a source tree).

    :raises ConfigError: if it is nowhere; the message lists the places.
    """
    prefixes = [p for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    # pip --user and --target put data files beside the packages or one prefix up.
    tree, *above = Path(__file__).resolve().parents[1:5]
    roots = [*map(Path, prefixes), Path(sys.prefix), tree, *above]
    places = [*(root / 'share/gait_segmentation' / name for root in roots), tree / name]
    for place in places:
        if place.is_file():
            return place
    listed = ', '.join(str(place) for place in places)
    raise ConfigError(f'{name} of gait_segmentation is not installed, looked for {listed}')


def prepare(environment: MutableMapping[str, str]) -> None:
    """Prepare the environment of a process for large images; what is set already stays."""
    if not any(environment.get(name) for name in _PROFILE):
        for name in _PROFILE:
            environment[name] = str(shared_file('config/fastdds_shm.xml'))


def read_yaml(path: Path, kind: type[GaitSegmentationError]) -> Any:
    """
    Read a YAML file.

    :param kind: of the error to be raised.
    :returns: what it holds, None if that is nothing.
    :raises GaitSegmentationError: of the kind, if it cannot be read or is not plain YAML.
    """
    try:
        return yaml.safe_load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise kind(f'{path} cannot be read: {error.strerror}') from error
    except (yaml.YAMLError, ValueError) as error:
        # Values such as dates are made by Python, which has errors of its own.
        raise kind(
            f'{path} is not YAML that can be used: {" ".join(str(error).split())}'
        ) from error


def film_name(path: Path) -> str:
    """Return the name by which OpenCV finds a film: FFmpeg takes ``A:`` for a protocol."""
    # With a slash before it, it is none.
    return os.path.join('.', path)


def keep_apart(
    outputs: Iterable[tuple[str, Path | None]], inputs: Iterable[Path], what: str = 'input'
) -> None:
    """
    Refuse outputs that would change an input, or what else is there.

    :param outputs: what is said of each file and folder to be written, and where it is to be,
        None if it is not wanted.
    :param inputs: files and folders that are read.
    :param what: what the message calls these.
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
                f'{name} {path} {how} the {what} {given}, which would be changed: choose another '
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
    """Write a file wholly or not at all; OSError, which names it, if that fails."""
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')
    try:
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        # It is the file asked for that matters.
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        part.unlink(missing_ok=True)
