# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding the files that are installed beside the package."""

from __future__ import annotations

import os
import sys
from collections.abc import MutableMapping
from pathlib import Path

from gait_segmentation.errors import ConfigError

__all__ = ['shared_file', 'use_shared_memory']

_PACKAGE = 'gait_segmentation'
_PROFILE = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


def shared_file(name: str) -> Path:
    """
    Return the path of a file such as ``config/fastdds_shm.xml``.

    Looked for in the ament prefixes (colcon), in the Python prefix (pip) and beside the package
    (a source tree).

    :raises ConfigError: if it is nowhere; the message lists the places.
    """
    prefixes = [p for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    here = Path(__file__).resolve()
    # pip --user and --target put data files beside the packages or one prefix up.
    roots = [Path(prefix) for prefix in (*prefixes, sys.prefix)]
    roots += [*here.parents[2:6]]
    places = [root / 'share' / _PACKAGE / name for root in roots]
    places.append(here.parents[2] / name)
    for place in places:
        if place.is_file():
            return place
    listed = ', '.join(str(place) for place in places)
    raise ConfigError(f'{name} of {_PACKAGE} is not installed, looked for {listed}')


def use_shared_memory(environment: MutableMapping[str, str]) -> None:
    """Let Fast DDS use the profile for large images, unless a profile is set already."""
    if not any(environment.get(name) for name in _PROFILE):
        for name in _PROFILE:
            environment[name] = str(shared_file('config/fastdds_shm.xml'))
