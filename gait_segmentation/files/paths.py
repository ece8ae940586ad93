# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders that can be written, and names of films."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

__all__ = ['film_name', 'make_writable']


def film_name(path: Path) -> str:
    """Return the name by which OpenCV finds a film: FFmpeg takes ``A:`` for a protocol."""
    # With a slash before it, it is none.
    return os.path.join('.', path)


def make_writable(folder: Path) -> None:
    """
    Make a folder in which files can be written.

    :raises OSError: if it cannot be made, or nothing can be written there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tempfile.TemporaryFile(dir=folder).close()
