# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The hand-over from the thread that receives messages to the one that works on them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any


class Worker:
    """
    A thread that works on the frames of a bounded queue, and makes calls, which go first.

    A frame that finds the queue full takes the place of all that wait: where the work cannot keep
    up, answers are late by less than a full queue, and that not for ever.
    """

    def __init__(self, limit: int, work: Callable[[Any], None]) -> None:
        """Start the thread: ``work`` gets every frame, of which ``limit`` may wait."""
        self.limit = limit
        self.failure: BaseException | None = None
        """An error that has ended the thread."""

        self._work = work
        self._frames: deque[Any] = deque()
        self._calls: deque[tuple[str, Callable[[], None]]] = deque()
        self._changed = threading.Condition()
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
        self._thread.start()

    def put(self, frame: Any) -> int:
        """Add a frame; return how many were dropped for it."""
        with self._changed:
            dropped = len(self._frames) if len(self._frames) >= self.limit else 0
            if dropped:
                self._frames.clear()
            self._frames.append(frame)
            self._changed.notify_all()
            return dropped

    def call(self, function: Callable[[], None], kind: str = '', most: int = 1) -> None:
        """
        Have a function called before the next frame.

        :param kind: of which only the ``most`` newest calls wait; those without a kind all do.
        """
        with self._changed:
            alike = [each for each in self._calls if kind and each[0] == kind]
            for each in alike[: max(len(alike) + 1 - most, 0)]:
                self._calls.remove(each)
            self._calls.append((kind, function))
            self._changed.notify_all()

    def drain(self, timeout_s: float) -> bool:
        """Wait until everything taken in is done; return whether it is."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._closed or not (self._calls or self._frames or self._busy), timeout_s
            )

    def stop(self) -> None:
        """Let the frame in work finish, drop the rest and end the thread."""
        self._close()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _next(self) -> Callable[[], None] | None:
        """Wait for something to do; return None when closed."""
        with self._changed:
            self._busy = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._calls or self._frames or self._closed)
            if self._closed:
                return None
            self._busy = True
            if self._calls:
                return self._calls.popleft()[1]
            return partial(self._work, self._frames.popleft())

    def _run(self) -> None:
        try:
            while (do := self._next()) is not None:
                do()
        except Exception as error:  # For the thread that can end the process.
            self.failure = error
            self._close()
