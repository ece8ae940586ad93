# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Telling files from pipes and devices, which may block whoever opens them, or never end."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

__all__ = ['regular']

_OTHERS = {
    stat.S_IFIFO: 'a pipe',
    stat.S_IFCHR: 'a device',
    stat.S_IFBLK: 'a device',
    stat.S_IFDIR: 'a folder',
    stat.S_IFSOCK: 'a socket',
}


def regular(path: str | os.PathLike[str]) -> Path:
    """
    Return the path of a file that may be opened to be read to its end.

    :raises OSError: if it is missing, or no file but a pipe, a device, a folder or a socket;
        ``strerror`` says so.
    """
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode):
        what = _OTHERS.get(stat.S_IFMT(mode), 'something else')
        raise OSError(errno.EINVAL, f'it is {what} and no file', os.fspath(path))
    return Path(path)
