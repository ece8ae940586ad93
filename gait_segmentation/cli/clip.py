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
from gait_segmentation.files.output_files import write_file
from gait_segmentation.geometry import Box

__all__ = ['CLIP_BOX', 'CLIP_START', 'demo_clip']

CLIP_START = 70
"""A frame in which the woman is in full view."""

CLIP_BOX = Box(1260, 519, 133, 414)
"""Her box in that frame, in pixels of the clip."""

_REQUIREMENT = 'sports2d==0.8.34'
_MEMBER = 'Sports2D/Demo/demo.mp4'
_SHA256 = 'd9a66417185647b112304b57093f0c180f37a768e6a14daca75ca541f3b78039'
_TIMEOUT_S = 240
_PIP = [sys.executable, '-m', 'pip', 'download', '--no-deps', '--only-binary', ':all:', '--quiet']
_PIP += ['--disable-pip-version-check', '--retries', '1', '--timeout', '20', _REQUIREMENT]


def demo_clip(folder: Path | None = None) -> Path:
    """
    Return the clip, fetched from the package index if it is not in the cache.

    :param folder: the cache; the user's if None.
    :raises SequenceError: if it cannot be fetched or is not what it should be.
    """
    folder = cache_folder() if folder is None else folder
    path = folder / 'sports2d-demo.mp4'
    if path.is_file() and _is_clip(path.read_bytes()):
        return path
    print(f'gait_demo: fetching the clip ({_REQUIREMENT}, kept in {folder})', file=sys.stderr)
    with tempfile.TemporaryDirectory() as download, zipfile.ZipFile(_wheel(download)) as wheel:
        clip = wheel.read(_MEMBER)
    if not _is_clip(clip):
        raise SequenceError(f'{_MEMBER} in {_REQUIREMENT} is not the film expected')
    folder.mkdir(parents=True, exist_ok=True)
    write_file(path, clip)
    return path


def cache_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/gait_segmentation``, by default below ``~/.cache``."""
    base = os.environ.get('XDG_CACHE_HOME', '')
    # The XDG specification: a relative path is to be ignored.
    root = Path(base) if os.path.isabs(base) else Path(os.path.expanduser('~/.cache'))
    return root / 'gait_segmentation'


def _wheel(folder: str) -> Path:
    """Download the wheel into a folder."""
    failure = ['pip fetched nothing']
    try:
        subprocess.run(
            [*_PIP, '--dest', folder],
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=True,
        )
    except subprocess.CalledProcessError as error:
        failure = error.stderr.strip().splitlines() or failure
    except (OSError, subprocess.TimeoutExpired) as error:
        failure = [str(error)]
    for wheel in Path(folder).glob('*.whl'):
        return wheel
    raise SequenceError(
        f'the clip cannot be fetched from the package index ({failure[-1]}). Without a network, '
        'run on a film of your own: gait_demo --clip FILE'
    )


def _is_clip(data: bytes) -> bool:
    return hashlib.sha256(data).hexdigest() == _SHA256
