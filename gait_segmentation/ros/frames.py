# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames on their way to the thread that works on them: joined by stamp, and handed over."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from statistics import fmean
from typing import Any

_MOMENT = 10
"""Frames that may wait for a moment, and after which it is known whether the work keeps up."""

_LONGEST_S = 1.0
"""Time between two frames from which they have paused."""

_TOO_MUCH, _ENOUGH = 1.0, 0.8
"""Load from which only the newest frame is worth its work, and below which all are again."""


class ExactJoin:
    """
    Collects the parts that belong to one stamp, to the nanosecond, until they are complete.

    Each part comes in the order of the images: when an entry is complete, those that began before
    it will never be, and are dropped, as is the oldest when too many wait.  The order is not that
    of stamps, which go back where a bag loops.
    """

    def __init__(self, stages: Mapping[str, Iterable[str]], capacity: int) -> None:
        """Keep ``capacity`` entries; parts are named by their node, in the order of the work."""
        self._stages = {part: stage for stage, parts in stages.items() for part in parts}
        self._first = next(iter(self._stages))
        self.capacity = capacity
        self.dropped: Counter[str] = Counter()
        """Entries dropped since the first that was complete, by the node they lacked a part of."""

        self._entries: dict[int, dict[str, Any]] = {}
        self._joined = False

    @property
    def waits_for(self) -> str:
        """Return the first node that the newest entry lacks a part of, empty without one."""
        begun = (each for each in reversed(self._entries.values()) if self._first in each)
        newest = next(begun, None)
        return '' if newest is None else self._lacking(newest)

    def add(self, part: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """Take in a part, the first of a stamp counts; return all if they are complete now."""
        entry = self._entries.setdefault(stamp_ns, {})
        entry.setdefault(part, value)
        if len(entry) == len(self._stages):
            self._joined = True
            while (oldest := next(iter(self._entries))) != stamp_ns:
                self._drop(oldest)
            return self._entries.pop(stamp_ns)
        if len(self._entries) > self.capacity:
            self._drop(next(iter(self._entries)))
        return None

    def _drop(self, stamp_ns: int) -> None:
        entry = self._entries.pop(stamp_ns)
        # Without the first part of all it is the rest of one that was dropped before.
        if self._joined and self._first in entry:
            self.dropped[self._lacking(entry)] += 1

    def _lacking(self, entry: Mapping[str, Any]) -> str:
        """Return the node of the first part that an entry lacks, in the order of the work."""
        return next(stage for part, stage in self._stages.items() if part not in entry)


class Worker:
    """
    A thread that works on the frames of a bounded queue, and makes calls, which go first.

    A frame that finds the queue full takes the place of all that wait.  Without a limit ten may
    wait, for a moment, but while frames take longer than they come only one: the work is always on
    the newest, and what is dropped is spread evenly.
    """

    def __init__(
        self,
        limit: int,
        work: Callable[[Any], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """
        Start the thread.

        :param limit: frames that may wait, 0 = as the load allows.
        :param work: gets every frame.
        :param clock: steady, in seconds.
        """
        self.limit = limit
        self._clock = clock
        self._took_s = deque[float](maxlen=_MOMENT)
        self._put_s = deque[float](maxlen=_MOMENT + 1)
        self._overloaded = False
        self.failure: BaseException | None = None
        """An error that has ended the thread."""

        self._work = work
        self._frames: deque[Any] = deque()
        self._calls: deque[tuple[str, Callable[[], None]]] = deque()
        self._changed = threading.Condition()
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
        self._thread.start()

    @property
    def took_s(self) -> float:
        """
        Return the time that a frame takes of late.

        It is the mean of all but the longest: one that waits for kernels is no load.
        """
        with self._changed:
            took_s = sorted(self._took_s)
        return fmean(took_s[:-1] or took_s) if took_s else 0.0

    @property
    def step_s(self) -> float:
        """Return the time between two frames, 0 as long as that is not known."""
        with self._changed:
            full = len(self._put_s) > _MOMENT
            return (self._put_s[-1] - self._put_s[0]) / _MOMENT if full else 0.0

    @property
    def load(self) -> float:
        """Return what frames take over the time between two, 0 as long as that is not known."""
        return self.took_s / step_s if (step_s := self.step_s) else 0.0

    def put(self, frame: Any) -> int:
        """Add a frame; return how many were dropped for it."""
        with self._changed:
            now_s = self._clock()
            if self._put_s and now_s - self._put_s[-1] >= _LONGEST_S:
                self._put_s.clear()
            self._put_s.append(now_s)
            self._overloaded = self.load > (_ENOUGH if self._overloaded else _TOO_MUCH)
            limit = self.limit or (1 if self._overloaded else _MOMENT)
            dropped = len(self._frames) if len(self._frames) >= limit else 0
            if dropped:
                self._frames.clear()
            self._frames.append(frame)
            self._changed.notify_all()
            return dropped

    def call(self, function: Callable[[], None], kind: str = '', most: int = 1) -> None:
        """Call a function before the next frame; of a kind only the ``most`` newest calls wait."""
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
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join()

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
            took_s = 0.0
            while (do := self._next()) is not None:
                began_s = self._clock()
                do()
                took_s += self._clock() - began_s
                # Calls are of the frame that comes after them.
                if isinstance(do, partial) and do.func is self._work:
                    with self._changed:
                        self._took_s.append(took_s)
                    took_s = 0.0
        except Exception as error:  # For the thread that can end the process.
            self.failure = error
            self.stop()
