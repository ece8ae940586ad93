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

_FOLDER = Path('/dev/shm')
_LOCK = re.compile(r'((fastrtps|fastdds)_[0-9a-z]{16})_el')
_YOUNG_S = 10.0
"""Age up to which a lock may not have been taken yet by the process that has just made it."""


def remove_dead_segments(folder: Path = _FOLDER) -> int:
    """
    Remove the segments of Fast DDS whose processes are gone, as ``fastdds shm clean`` does.

    Without this the memory of killed nodes stays until the next boot.  Only this user's segments
    are looked at; a process holds the lock of its segment for as long as it lives.

    :param folder: where the system keeps shared memory.
    :returns: how many bytes were freed.
    """
    freed = 0
    for lock in sorted(folder.iterdir()) if folder.is_dir() else ():
        named = _LOCK.fullmatch(lock.name)
        # Another process may be cleaning up as well, and a lock that is held is an OSError.
        with suppress(OSError):
            about = lock.lstat()
            if named and about.st_uid == os.geteuid() and time.time() - about.st_mtime > _YOUNG_S:
                freed += _remove(lock, folder / named[1])
    return freed


def _remove(lock: Path, segment: Path) -> int:
    """
    Remove a segment and its lock; return how many bytes that frees.

    :raises OSError: if its process lives, or the lock was removed before it could be taken.
    """
    held = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(held), lock.stat()):
            raise FileNotFoundError(lock)
        size = segment.lstat().st_size if segment.exists() else 0
        segment.unlink(missing_ok=True)
        lock.unlink()
    finally:
        os.close(held)
    return size
