# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding the files that are installed beside the package, and the environment of nodes."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import MutableMapping
from pathlib import Path

from gait_segmentation.errors import ConfigError

_PACKAGE = 'gait_segmentation'
_MALLOC = {
    'MALLOC_MMAP_THRESHOLD_': 32 << 20,
    'MALLOC_TRIM_THRESHOLD_': 256 << 20,
    'MALLOC_ARENA_MAX': 1,
}
"""
Have glibc keep freed memory, for all threads, for the next image: to have the kernel make fresh
pages takes several times as long as to copy the image.
"""

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
    tree, *above = Path(__file__).resolve().parents[2:6]
    roots = [*map(Path, prefixes), Path(sys.prefix), tree, *above]
    places = [*(root / 'share' / _PACKAGE / name for root in roots), tree / name]
    for place in places:
        if place.is_file():
            return place
    listed = ', '.join(str(place) for place in places)
    raise ConfigError(f'{name} of {_PACKAGE} is not installed, looked for {listed}')


def prepare(environment: MutableMapping[str, str]) -> None:
    """
    Prepare the environment of a process for large images; what is set already stays.

    Fast DDS uses the profile for them, and glibc keeps freed memory.
    """
    for name, value in _MALLOC.items():
        environment.setdefault(name, str(value))
    if not any(environment.get(name) for name in _PROFILE):
        for name in _PROFILE:
            environment[name] = str(shared_file('config/fastdds_shm.xml'))


def make_writable(folder: Path) -> None:
    """
    Make a folder in which files can be written.

    :raises OSError: if it cannot be made, or nothing can be written there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tempfile.TemporaryFile(dir=folder).close()
