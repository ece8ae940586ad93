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

CLIP_START = 70
"""A frame in which the woman is in full view."""

CLIP_BOX = Box(1260, 519, 133, 414)
"""Her box in that frame, in pixels of the clip."""

_REQUIREMENT = 'sports2d==0.8.34'
_MEMBER = 'Sports2D/Demo/demo.mp4'
_SHA256 = 'd9a66417185647b112304b57093f0c180f37a768e6a14daca75ca541f3b78039'
_PIP = [sys.executable, '-m', 'pip', 'download', '--no-deps', '--only-binary', ':all:', '--quiet']
_PIP += ['--disable-pip-version-check', '--retries', '1', '--timeout', '20', _REQUIREMENT]


def demo_clip() -> Path:
    """
    Return the clip, fetched from the package index if it is not in the cache.

    :raises SequenceError: if it cannot be fetched or is not what it should be.
    """
    folder = Path(os.environ.get('XDG_CACHE_HOME') or '~/.cache').expanduser()
    path = folder / 'gait_segmentation/sports2d-demo.mp4'
    if path.is_file() and _is_clip(path.read_bytes()):
        return path
    print(f'gait_demo: fetching the clip ({_REQUIREMENT}, kept in {path})', file=sys.stderr)
    with tempfile.TemporaryDirectory() as download:
        pip = subprocess.run([*_PIP, '--dest', download], stderr=subprocess.PIPE, text=True)
        if pip.returncode:
            raise SequenceError(
                f'the clip cannot be fetched from the package index ({pip.stderr.strip()}). '
                'Without a network, run on a film of your own: gait_demo --clip FILE'
            )
        (wheel,) = Path(download).glob('*.whl')
        with zipfile.ZipFile(wheel) as archive:
            clip = archive.read(_MEMBER)
    if not _is_clip(clip):
        raise SequenceError(f'{_MEMBER} in {_REQUIREMENT} is not the film expected')
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, clip)
    return path


def _is_clip(data: bytes) -> bool:
    return hashlib.sha256(data).hexdigest() == _SHA256
