# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What processes that were killed have left in shared memory."""

from __future__ import annotations

import fcntl
import os
import re
import time
from contextlib import suppress
from pathlib import Path

__all__ = ['remove_dead_segments']

_FOLDER = Path('/dev/shm')
_LOCK = re.compile(r'((fastrtps|fastdds)_[0-9a-z]{16})_el')
_YOUNG_S = 10.0
"""Age up to which a lock may not have been taken yet by the process that has just made it."""


def remove_dead_segments(folder: Path = _FOLDER) -> int:
    """
    Remove the segments of Fast DDS whose processes are gone, as ``fastdds shm clean`` does.

    A process holds a lock on a file beside its segment for as long as it lives; the system takes
    the lock away from the dead.  Only this user's segments are looked at.

    :param folder: where the system keeps shared memory.
    :returns: how many bytes were freed.
    """
    freed = 0
    if not folder.is_dir():
        return freed
    for path in sorted(folder.iterdir()):
        named = _LOCK.fullmatch(path.name)
        # Another process may be cleaning up as well.
        with suppress(OSError):
            if named and _is_ours(path):
                freed += _remove_if_dead(path, folder / named[1])
    return freed


def _is_ours(path: Path) -> bool:
    """Return whether it is a file of this user that has been there for a while."""
    about = path.lstat()
    return about.st_uid == os.geteuid() and time.time() - about.st_mtime > _YOUNG_S


def _remove_if_dead(lock: Path, segment: Path) -> int:
    held = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        size = segment.lstat().st_size if segment.exists() else 0
        segment.unlink(missing_ok=True)
        lock.unlink()
        return size
    except BlockingIOError:
        return 0
    finally:
        os.close(held)
