# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The hand-over from the thread that receives messages to the one that works on them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any

CAUGHT_UP = 10
"""Frames in a row after which nothing waited, for the work to have caught up."""


class Backlog:
    """
    A bounded queue of frames that prefers the newest, and a lane of calls that go first.

    Short hiccups lose nothing: up to ``limit`` frames wait and are worked on in order.  When
    more come, the work cannot keep up: all but the newest frame are dropped and counted, and
    until the work has caught up only the newest one waits.  What comes out of an overloaded
    computer then is late by a frame's work rather than by a full backlog's, and evenly spaced
    rather than in bursts with gaps, which is easier to track.
    """

    def __init__(self, limit: int) -> None:
        """Make an empty backlog for ``limit`` waiting frames."""
        self.limit = limit
        self._behind = False
        self._in_time = 0
        self._frames: deque[Any] = deque()
        self._calls: deque[tuple[str, Callable[[], None]]] = deque()
        self._changed = threading.Condition()
        self._busy = self._on_frame = False
        self._closed = False

    def put(self, frame: Any) -> int:
        """Add a frame; return how many were dropped for it."""
        with self._changed:
            dropped = 0
            if len(self._frames) >= (1 if self._behind else self.limit):
                dropped = len(self._frames)
                self._frames.clear()
                self._behind = True
                self._in_time = 0
            self._frames.append(frame)
            self._changed.notify_all()
            return dropped

    def call(self, function: Callable[[], None], kind: str = '', most: int = 1) -> int:
        """
        Have a function called before the next frame.

        :param kind: of which only the newest calls wait; those without a kind all do.
        :param most: how many of the kind may wait.
        :returns: how many that waited were dropped for it.
        """
        with self._changed:
            alike = [each for each in self._calls if kind and each[0] == kind]
            dropped = alike[: len(alike) + 1 - most]
            for each in dropped:
                self._calls.remove(each)
            self._calls.append((kind, function))
            self._changed.notify_all()
            return len(dropped)

    def take(self) -> Callable[[], None] | tuple[Any] | None:
        """
        Wait for something to do, which also says that what was taken before is done.

        :returns: a call, a frame in a tuple of one, or None when closed.
        """
        with self._changed:
            if self._on_frame:
                self._note_pace()
            self._busy = self._on_frame = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._calls or self._frames or self._closed)
            if self._closed:
                return None
            self._busy = True
            self._on_frame = not self._calls
            return self._calls.popleft()[1] if self._calls else (self._frames.popleft(),)

    def _note_pace(self) -> None:
        """Count frames after which nothing waited: so many in a row, and all may wait again."""
        self._in_time = 0 if self._frames else self._in_time + 1
        if self._in_time >= CAUGHT_UP:
            self._behind = False

    def drain(self, timeout_s: float) -> bool:
        """Wait until everything taken in is done; return whether it is."""
        with self._changed:
            return self._changed.wait_for(
                lambda: not (self._calls or self._frames or self._busy) or self._closed, timeout_s
            )

    def close(self) -> None:
        """Drop everything and let :meth:`take` return None from now on."""
        with self._changed:
            self._frames.clear()
            self._calls.clear()
            self._closed = True
            self._changed.notify_all()


class Worker:
    """The one thread that works on a backlog."""

    def __init__(
        self,
        backlog: Backlog,
        work: Callable[[Any], None],
        failed: Callable[[BaseException], None],
    ) -> None:
        """Start the thread: ``work`` gets every frame, ``failed`` an error that ends it."""
        self.backlog = backlog
        self._work = work
        self._failed = failed
        self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Let the frame in work finish, drop the rest and end the thread."""
        self.backlog.close()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        try:
            while (item := self.backlog.take()) is not None:
                if isinstance(item, tuple):
                    self._work(item[0])
                else:
                    item()
        except Exception as error:  # Handed on to the thread that can end the process.
            self.backlog.close()
            self._failed(error)
