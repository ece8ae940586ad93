# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The clip of the demonstration: a woman who walks past a standing camera.

It is part of the package Sports2D (David Pagnon, BSD-3-Clause) and is taken out of its wheel on
the Python package index, once, and kept in the user's cache folder.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box

__all__ = ['CLIP_BOX', 'CLIP_START', 'demo_clip']

CLIP_START = 70
"""A frame in which the woman is in full view."""

CLIP_BOX = Box(1260, 519, 133, 414)
"""Her box in that frame, in pixels of the clip."""

_REQUIREMENT = 'sports2d==0.8.34'
_WHEEL_SHA256 = '733b6db70742636ae9c35d870c22bd416582f579abd5881bee93a14bb0e2655d'
_MEMBER = 'Sports2D/Demo/demo.mp4'
_CLIP_SHA256 = 'd9a66417185647b112304b57093f0c180f37a768e6a14daca75ca541f3b78039'
_TIMEOUT_S = 240


def demo_clip(folder: Path | None = None) -> Path:
    """
    Return the clip, fetched from the package index if it is not in the cache.

    :param folder: the cache; the user's if None.
    :raises SequenceError: if it cannot be fetched or is not what it should be.
    """
    folder = cache_folder() if folder is None else folder
    path = folder / 'sports2d-demo.mp4'
    if path.is_file() and _sha256(path.read_bytes()) == _CLIP_SHA256:
        return path
    print(f'gait_demo: fetching the clip ({_REQUIREMENT}, kept in {folder})', file=sys.stderr)
    with tempfile.TemporaryDirectory() as download:
        clip = clip_of_wheel(_download(Path(download)))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Renamed when complete, so that nobody sees half a film.
        part = path.with_suffix(f'.{os.getpid()}.part')
        part.write_bytes(clip)
        part.replace(path)
    except OSError as error:
        raise SequenceError(f'the clip cannot be kept in {folder}: {error}') from error
    return path


def cache_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/gait_segmentation``, by default below ``~/.cache``."""
    base = os.environ.get('XDG_CACHE_HOME', '')
    # The XDG specification: a relative path is to be ignored.
    root = Path(base) if os.path.isabs(base) else Path(os.path.expanduser('~/.cache'))
    return root / 'gait_segmentation'


def clip_of_wheel(wheel: Path) -> bytes:
    """
    Return the film inside a wheel.

    :raises SequenceError: if the wheel or the film in it is not the one expected.
    """
    found = _sha256(wheel.read_bytes())
    if found != _WHEEL_SHA256:
        raise SequenceError(f'{wheel.name} must have the SHA-256 {_WHEEL_SHA256}, got {found}')
    with zipfile.ZipFile(wheel) as archive:
        clip = archive.read(_MEMBER)
    if _sha256(clip) != _CLIP_SHA256:
        raise SequenceError(f'{_MEMBER} in {wheel.name} is not the film expected')
    return clip


def _download(folder: Path) -> Path:
    command = [sys.executable, '-m', 'pip', 'download', '--no-deps', '--only-binary', ':all:']
    command += ['--disable-pip-version-check', '--quiet', '--retries', '1', '--timeout', '20']
    command += ['--dest', str(folder), _REQUIREMENT]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S)
        failure = done.stderr.strip().splitlines()[-1:] if done.returncode else []
        failed = done.returncode != 0
    except (OSError, subprocess.TimeoutExpired) as error:
        failure, failed = [str(error)], True
    wheels = sorted(folder.glob('*.whl'))
    if failed or not wheels:
        reason = failure[0] if failure else 'pip fetched nothing'
        raise SequenceError(
            f'the clip cannot be fetched from the package index ({reason}). Without a network, '
            'run on a film of your own: gait_demo --clip FILE'
        )
    return wheels[0]


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
