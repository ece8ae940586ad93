# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an output of gait_replay is: made under another name, renamed when it is complete."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import named
from gait_segmentation.inputs import Frame
from gait_segmentation.pipeline import FrameResult

__all__ = ['About', 'Output', 'Replayed', 'partial_path', 'remove', 'work_path']


@dataclass(frozen=True)
class About:
    """What outputs are told of an input: ``size`` is width and height, ``slots`` for people."""

    size: tuple[int, int] = (0, 0)
    fps: float = 0.0
    slots: int = 1


@dataclass(frozen=True)
class Replayed:
    """A frame of the input and what was found in it."""

    frame: Frame
    result: FrameResult


def work_path(path: Path) -> Path:
    """Return where an output is while it is made: beside it, so that it can be renamed."""
    return path.with_name(f'.{path.stem}.part{path.suffix}')


def partial_path(path: Path) -> Path:
    """Return where an output that was broken off is left."""
    return path.with_name(f'{path.stem}.partial{path.suffix}')


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


class Output(ABC):
    """
    A file or folder of results.

    It is at :func:`work_path` while it grows.  :meth:`close` moves it to its name, or, if the
    replay was broken off, to :func:`partial_path`; it can be read in both cases.
    """

    option: ClassVar[str]
    """The option of the command that asks for it."""

    help: ClassVar[str]
    """What the command says of the option."""

    default: ClassVar[Path | None] = None
    """Where it goes if the option is not given, None if it is not wanted then."""

    suffix: ClassVar[str] = ''
    """Of the name of a file, where several inputs have one each in a folder."""

    in_folder: ClassVar[bool] = False
    """Whether the option names a folder of such outputs for a single input, too."""

    files: ClassVar[re.Pattern[str] | None] = None
    """Of an output that is a folder: the files that it may hold, relative to it."""

    def __init__(self, path: Path, about: About | None = None) -> None:
        """
        Begin an empty output in place of what an earlier attempt left.

        :raises SequenceError: if the place cannot be used, see :meth:`check`, or another process
            is just making the output.
        """
        self.check(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._closed = False
        self.path = path
        self.about = about or About()
        self.work = work_path(path)
        self._held: int | None = None
        self._take_place()
        try:
            remove(partial_path(path))
            with named(path):
                self.begin()
            # The end of a process frees it.
            self._held = os.open(self.work, os.O_RDONLY)
            fcntl.flock(self._held, fcntl.LOCK_SH)
        except BaseException:
            self._let_go()
            raise

    def _take_place(self) -> None:
        """
        Remove what a process that was killed has left at :attr:`work`.

        :raises SequenceError: if another process is just making it, or it is somebody else's.
        """
        if not self.work.exists():
            return
        if self.work.is_dir() and self.made() != self.work:
            for each in self.work.iterdir():
                if each != self.made():
                    raise SequenceError(
                        f'{self.work} holds {each.name} and is not replaced; remove it'
                    )
        self._check_kind(self.work if self.work.is_file() else self.made())
        held = os.open(self.work, os.O_RDONLY)
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise SequenceError(f'{self.path} is just being made by another process') from error
        finally:
            os.close(held)
        remove(self.work)

    def begin(self) -> None:
        """
        Begin the file or folder at :attr:`work`; here, an empty folder.

        :raises OSError: if it cannot be written.
        :raises SequenceError: if there can be no such output.
        """
        self.work.mkdir(parents=True)

    @classmethod
    def place(cls, given: Path, name: str, *, several: bool) -> Path:
        """
        Return where the output of an input goes.

        :param given: what the option says.
        :param name: of the input.
        :param several: whether there are more inputs.
        """
        return given / f'{name}{cls.suffix}' if several or cls.in_folder else given

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether what is there, of the right names, may be an output of this kind."""
        return True

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether something is there; an empty file or folder is nothing."""
        if cls.files is None:
            return path.is_file() and path.stat().st_size > 0
        return path.is_dir() and any(path.iterdir())

    @classmethod
    def check(cls, path: Path) -> None:
        """
        Refuse a place where there is something else than such an output.

        :raises SequenceError: if it is below a file, or there is anything, there or where this
            would be left when broken off, that this has not made.
        """
        above = next(folder for folder in path.absolute().parents if folder.exists())
        if not above.is_dir():
            raise SequenceError(f'{above} is a file, not a folder, and is not replaced; remove it')
        for each in (path, partial_path(path)):
            cls._check_kind(each)
        if cls.is_there(path) and not cls.is_own(path):
            raise SequenceError(
                f'{path} was not made by gait_replay, or is not all there, and is not replaced; '
                'remove it or choose another place'
            )

    @classmethod
    def _check_kind(cls, path: Path) -> None:
        if cls.files is None and path.is_dir():
            raise SequenceError(f'{path} is a folder, not a file, and is not replaced; remove it')
        if cls.files is not None and path.is_file():
            raise SequenceError(f'{path} is a file, not a folder, and is not replaced; remove it')
        if path.exists() and not (path.is_dir() or path.is_file()):
            raise SequenceError(f'{path} is neither a file nor a folder, and is not replaced')
        if cls.files is None:
            return
        for each in path.rglob('*'):
            if not each.is_dir() and not cls.files.fullmatch(each.relative_to(path).as_posix()):
                raise SequenceError(f'{path} holds {each.name} and is not replaced; remove it')

    @abstractmethod
    def add(self, replayed: Replayed) -> None:
        """
        Add a frame.

        :raises OSError: if it cannot be written.
        """

    @contextlib.contextmanager
    def written(self) -> Iterator[None]:
        """
        Have errors name the output.

        :raises SequenceError: if it cannot be written because somebody has removed it meanwhile.
        """
        try:
            with named(self.path):
                yield
        except (OSError, SequenceError) as error:
            if self.work.exists():
                raise
            raise SequenceError(
                f'{self.path} cannot be made: {self.work}, which was to become it, was removed '
                'meanwhile'
            ) from error

    def finish(self) -> None:  # noqa: B027
        """
        Write what belongs to the end; here, nothing.

        :raises OSError: if it cannot be written.
        """

    def close(self, *, complete: bool) -> None:
        """
        Finish, and give the output its name; nothing if that was done.

        :raises OSError: if it is to be complete and cannot be finished.
        :raises SequenceError: likewise.
        """
        if self._closed:
            return
        if complete:
            with self.written():
                self.finish()
                remove(self.path)
                self.made().replace(self.path)
            self._let_go()
        else:
            try:
                with contextlib.suppress(OSError, SequenceError):
                    self.finish()
                if self.made().exists():
                    self.made().replace(partial_path(self.path))
            finally:
                self._let_go()

    def _let_go(self) -> None:
        """Leave nothing behind but what has its name."""
        self._closed = True
        try:
            remove(self.work)
        finally:
            if self._held is not None:
                os.close(self._held)

    def made(self) -> Path:
        """Return the finished file or folder, before it has its name."""
        return self.work
