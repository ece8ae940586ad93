# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What processes that were killed have left in shared memory."""

from __future__ import annotations

import fcntl
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

__all__ = ['dead_ports_avoided', 'remove_dead_segments']

_FOLDER = Path('/dev/shm')
_LOCK = re.compile(r'((fastrtps|fastdds)_[0-9a-z]{16})_el')
_YOUNG_S = 10.0
"""Age up to which a lock may not have been taken yet by the process that has just made it."""

_PORT = re.compile(r'(fastrtps|fastdds)_port[0-9]+')
_WRITTEN_S = 30.0
"""Age up to which somebody may still write to a dead process: Fast DDS does so for 20 s."""

_TRIES, _TRY_S = 3, 0.001
"""A lock is taken for a moment by everybody who looks whether the port's reader is dead."""


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


@contextmanager
def dead_ports_avoided(folder: Path = _FOLDER) -> Iterator[None]:
    """
    Keep the DDS from reading from the port of a dead process, in what is made meanwhile.

    A process reads all messages from one port, whose number is that of a process before it which
    has ended.  If that was killed, others go on writing for 20 s: for the first two to the memory
    of the dead, and then each of their messages makes the port and removes it again, in a way
    that two processes can be in at a time.  A reader that opens the port in the middle of that
    may be left with memory that has no name any more, so that it hears nobody for ever.  So the
    locks of such ports are held; Fast DDS takes the next number then.  What the dead have left is
    removed in the end.  Only this user's ports are looked at.

    :param folder: where the system keeps shared memory.
    """
    held = _take_dead_ports(folder)
    try:
        yield
    finally:
        for each in held:
            each.release()


@dataclass(frozen=True)
class _Taken:
    """A port whose reader is dead, and whose lock is held here."""

    port: Path
    descriptor: int
    is_left: bool
    """Whether the reader has left a lock, so that what there is of the port is its."""

    def release(self) -> None:
        """Remove what the reader has left, and let go of the lock."""
        for path in (self.port, _lock_of(self.port)) if self.is_left else (_lock_of(self.port),):
            with suppress(OSError):
                path.unlink(missing_ok=True)
        os.close(self.descriptor)


def _take_dead_ports(folder: Path) -> list[_Taken]:
    ports = _ports(folder)
    taken = []
    for _ in range(_TRIES):
        found = {port: _take_if_dead(port) for port in ports}
        taken += [each for each in found.values() if each is not None]
        ports = [port for port, each in found.items() if each is None]
        if not ports:
            break
        time.sleep(_TRY_S)
    return taken


def _ports(folder: Path) -> list[Path]:
    """Return the ports with at most one reader each; others have locks of another kind."""
    names = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    ports = {name.removesuffix('_el') for name in names}
    return [
        folder / name
        for name in sorted(ports)
        if _PORT.fullmatch(name) and f'{name}_sl' not in names
    ]


def _take_if_dead(port: Path) -> _Taken | None:
    lock = _lock_of(port)
    with suppress(OSError):
        is_left = lock.exists()
        about = (lock if is_left else port).lstat()
        if about.st_uid != os.geteuid():
            return None
        if not is_left and time.time() - about.st_ctime > _WRITTEN_S:
            return None
        flags = os.O_RDONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
        held = os.open(lock, flags, 0o666)
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Whoever had it before may have removed the file.
            if os.path.samestat(os.fstat(held), lock.stat()):
                return _Taken(port, held, is_left)
        except OSError:
            pass
        os.close(held)
    return None


def _lock_of(port: Path) -> Path:
    return port.with_name(f'{port.name}_el')
