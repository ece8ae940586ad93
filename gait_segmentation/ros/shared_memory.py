# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What processes that were killed have left in shared memory."""

from __future__ import annotations

import fcntl
import os
import re
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

__all__ = ['DeadPorts', 'remove_dead_segments']

_FOLDER = Path('/dev/shm')
_LOCK = re.compile(r'((fastrtps|fastdds)_[0-9a-z]{16})_el')
_YOUNG_S = 10.0
"""Age up to which a lock may not have been taken yet by the process that has just made it."""

_PORT = re.compile(r'(fastrtps|fastdds)_port[0-9]+')
_HOLD_S, _MOST = 30.0, 64
"""How long locks of the dead are held, longer than anybody writes to them, and how many."""

_DEAD = b'the process is dead'
"""Written to its lock, which is empty else."""

_LOOKED_AT_S = 0.5
"""Up to this age a lock may be one that somebody made just to look whether there is another."""

_LOOK_S = 0.4
"""Others notice a death after one to two seconds."""

_TRIES, _TRY_S = 3, 0.001


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

    So whoever lives holds the locks of the dead for half a minute: then nobody takes them for
    free, and new processes take other numbers.  After that all that the dead have left is
    removed.  Only this user's ports are looked at.
    """

    def __init__(self, folder: Path = _FOLDER, hold_s: float = _HOLD_S) -> None:
        """
        Take the ports of the dead, also those that are only written to any more.

        :param folder: where the system keeps shared memory.
        :param hold_s: time after which what they have left is removed.
        """
        self._folder = folder
        self._hold_s = hold_s
        self._held: dict[Path, _Held] = {}
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
        Take the ports of those that have died, and remove what was held for long enough.

        :param written: take also those of which nothing is left but what others write to.
        """
        names = {path.name for path in self._folder.iterdir()} if self._folder.is_dir() else set()
        for name in sorted(filter(_PORT.fullmatch, names)):
            port = self._folder / name
            # Ports with many readers have locks of another kind.
            if f'{name}_sl' in names or port in self._held:
                continue
            if len(self._held) < _MOST and (written or f'{name}_el' in names):
                with suppress(OSError):
                    self._held[port] = _Held.of(port)
        for port, held in list(self._held.items()):
            if time.time() - held.since_s >= self._hold_s:
                self._held.pop(port).release()

    def close(self) -> None:
        """Look no more, and let go of everything."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()
        # What is not due stays as it is: others may still write there.
        while self._held:
            os.close(self._held.popitem()[1].descriptor)

    def _run(self) -> None:
        while not self._over.wait(_LOOK_S):
            with suppress(OSError):
                self.look()


@dataclass(frozen=True)
class _Held:
    """The lock of a dead process's port."""

    port: Path
    descriptor: int
    since_s: float
    """When it was found dead; so that it is not held for ever, whoever finds it writes there."""

    @classmethod
    def of(cls, port: Path) -> _Held:
        """
        Take it.

        :raises OSError: if the process lives, or the port is not this user's.
        """
        lock = _lock_of(port)
        is_left = lock.exists()
        about = (lock if is_left else port).lstat()
        age_s = time.time() - about.st_mtime
        fits = about.st_size > 0 or age_s > _LOOKED_AT_S if is_left else age_s < _HOLD_S
        if about.st_uid != os.geteuid() or not fits:
            raise PermissionError
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
        descriptor = os.open(lock, flags, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Whoever had it before may have removed the file.
            if not os.path.samestat(os.fstat(descriptor), lock.stat()):
                raise FileNotFoundError
            if not os.fstat(descriptor).st_size:
                os.write(descriptor, _DEAD)
            return cls(port, descriptor, os.fstat(descriptor).st_mtime)
        except OSError:
            os.close(descriptor)
            raise

    def release(self) -> None:
        """Remove what the process has left, and let go of the lock."""
        for path in (self.port, _lock_of(self.port)):
            with suppress(OSError):
                path.unlink(missing_ok=True)
        os.close(self.descriptor)


def _lock_of(port: Path) -> Path:
    return port.with_name(f'{port.name}_el')
