# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What processes that were killed have left in shared memory."""

from __future__ import annotations

import fcntl
import os
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_FOLDER = Path('/dev/shm')
_LOCK = re.compile(r'((fastrtps|fastdds)_[0-9a-z]{16})_el')
_YOUNG_S = 10.0
"""Age up to which a lock may not have been taken yet by the process that has just made it."""

_PORT = re.compile(r'(fastrtps|fastdds)_port[0-9]+')
_CLOSED_S = 30.0
"""How long the ports of the dead are closed, longer than anybody writes to them."""

_LOOKED_AT_S = 0.5
"""Up to this age a lock may be one that somebody made just to look whether there is another."""

_LOOK_S = 0.4
"""Others notice a death after one to two seconds."""

_TRIES, _TRY_S = 3, 0.001


def remove_dead_segments(folder: Path = _FOLDER) -> int:
    """
    Remove the segments of Fast DDS whose processes are gone, as ``fastdds shm clean`` does.

    Only this user's segments are looked at.

    :param folder: where the system keeps shared memory.
    :returns: how many bytes were freed.
    """
    freed = 0
    for lock in sorted(folder.iterdir()) if folder.is_dir() else ():
        named = _LOCK.fullmatch(lock.name)
        # Another process may be cleaning up as well.
        with suppress(OSError):
            if named and _is_ours(lock) and _age_s(lock) > _YOUNG_S:
                segment = folder / named[1]
                with _of_the_dead(lock):
                    size = segment.lstat().st_size if segment.exists() else 0
                    segment.unlink(missing_ok=True)
                freed += size
    return freed


@contextmanager
def _of_the_dead(lock: Path, flags: int = os.O_RDONLY) -> Iterator[None]:
    """
    Hold the lock of a process that is gone, and remove it afterwards.

    A process holds its locks for as long as it lives; the system takes them away from the dead.

    :raises OSError: if the process lives, or the lock was removed before it could be taken.
    """
    held = os.open(lock, flags | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(held), lock.stat()):
            raise FileNotFoundError(lock)
        yield
        lock.unlink()
    finally:
        os.close(held)


def _is_ours(path: Path) -> bool:
    return path.lstat().st_uid == os.geteuid()


def _age_s(path: Path) -> float:
    return time.time() - path.lstat().st_mtime


class DeadPorts:
    """
    Keeps the DDS away from what killed processes were reading from.

    A process reads all messages from a port, a ring in shared memory with a number.  After it was
    killed others go on writing there for 20 s, and Fast DDS 2.14 is not up to that.  Who notices
    that the lock of the port is free may wait for ever for what the dead was reading.  A process
    that takes the number anew, as one that is started again does, gets nothing as long as the
    others write to the memory of the dead; and since they make the port anew with every message,
    in a way that two processes can be in at a time, it may be left with memory that has no name
    any more, and hear nobody for ever.

    So whoever lives puts an empty folder in the port's place for half a minute.  Nobody can open
    or make the port then: new processes take other numbers at once, and what is written to the
    dead is dropped.  Only this user's ports are looked at.
    """

    def __init__(self, folder: Path = _FOLDER, closed_s: float = _CLOSED_S) -> None:
        """
        Close the ports of the dead, also those that are only written to any more.

        :param folder: where the system keeps shared memory.
        :param closed_s: time after which the numbers are free again.
        """
        self._folder = folder
        self._closed_s = closed_s
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name='ports', daemon=True)
        # Everybody who looks whether a reader is dead holds its lock for a moment.
        for _ in range(_TRIES):
            self.look(written=True)
            time.sleep(_TRY_S)

    def start(self) -> None:
        """Look for more in a thread of its own, so often that nobody else notices them before."""
        self._thread.start()

    def look(self, *, written: bool = False) -> None:
        """
        Close the ports of those that have died, and free the numbers closed for long enough.

        :param written: close also those of which nothing is left but what others write to.
        """
        names = {path.name for path in self._folder.iterdir()} if self._folder.is_dir() else set()
        for name in sorted(filter(_PORT.fullmatch, names)):
            # Ports with many readers have locks of another kind.
            if f'{name}_sl' in names:
                continue
            port = self._folder / name
            # Others do the same.
            with suppress(OSError):
                if port.is_dir():
                    if _age_s(port) >= self._closed_s:
                        port.rmdir()
                elif written or f'{name}_el' in names:
                    _close(port)

    def close(self) -> None:
        """Look no more; what is closed stays so, for others may still write there."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        while not self._over.wait(_LOOK_S):
            with suppress(OSError):
                self.look()


def _close(port: Path) -> None:
    """
    Put a folder in the place of a port whose reader is dead.

    :raises OSError: if the reader lives.
    """
    lock = port.with_name(f'{port.name}_el')
    if (lock.exists() and _age_s(lock) < _LOOKED_AT_S) or not _is_ours(port):
        return
    # With the lock nobody else can begin to read there.
    with _of_the_dead(lock, os.O_RDWR | os.O_CREAT):
        for _ in range(_TRIES):
            port.unlink(missing_ok=True)
            # Who writes there may just have made it anew.
            with suppress(FileExistsError):
                port.mkdir()
                return
