# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a node is doing: counters and times of frames, warnings that do not flood the log."""

from __future__ import annotations

import math
import threading
from collections import Counter, deque
from collections.abc import Callable

import numpy as np

from gait_segmentation.streams.join import ExactJoin

_WINDOW = 150
"""Frames that rates and latencies are taken over."""

_RECENT_S = 5.0
"""Time that rates are taken over."""


class Statistics:
    """
    What is known of the frames of a node.

    Times are seconds of any steady clock.  May be used by several threads.
    """

    def __init__(self) -> None:
        """Begin with nothing received."""
        self.received = self.processed = self.skipped = self.failed = 0
        self.lost = self.incomplete = self.stale = 0
        self.last_stamp_ns = 0
        self._arrivals: deque[float] = deque(maxlen=_WINDOW)
        self._departures: deque[float] = deque(maxlen=_WINDOW)
        self._latencies_s: deque[float] = deque(maxlen=_WINDOW)
        self._told = (0, 0)
        self._since_s = math.nan
        self._lock = threading.Lock()

    def arrived(self, now_s: float, stamp_ns: int) -> None:
        """Count a frame received."""
        with self._lock:
            self.received += 1
            self.last_stamp_ns = stamp_ns
            self._arrivals.append(now_s)

    def finished(self, latency_s: float, now_s: float = 0.0) -> None:
        """Count a frame whose output is published, ``latency_s`` after its arrival."""
        with self._lock:
            self.processed += 1
            self._latencies_s.append(latency_s)
            self._departures.append(now_s)

    def rates_hz(self, now_s: float) -> tuple[float, float]:
        """Return the rates of frames and of outputs over the last 5 seconds, 0 without."""
        with self._lock:
            recent = [
                [each for each in times if now_s - each <= _RECENT_S]
                for times in (self._arrivals, self._departures)
            ]
        frames, outputs = (
            (len(times) - 1) / (times[-1] - times[0]) if times and times[-1] > times[0] else 0.0
            for times in recent
        )
        return frames, outputs

    def expect(self, now_s: float) -> None:
        """Note that frames are to come from now on."""
        with self._lock:
            self._since_s = now_s

    def quiet_s(self, now_s: float) -> float:
        """Return the time for which frames were to come and none did, NaN if none are to."""
        with self._lock:
            last_s = self._arrivals[-1] if self._arrivals else math.nan
            # NaN gives way to the other.
            return now_s - float(np.fmax(last_s, self._since_s))

    def losses(self) -> tuple[int, int]:
        """Return the frames lost, incomplete, skipped or stale, and failed, since last asked."""
        now = (self.lost + self.incomplete + self.skipped + self.stale, self.failed)
        before, self._told = self._told, now
        return now[0] - before[0], now[1] - before[1]

    def latency_ms(self) -> tuple[float, float]:
        """Return median and 95th percentile of the time from arrival to output, NaN without."""
        with self._lock:
            values = list(self._latencies_s) or [math.nan]
        median, high = np.percentile(values, (50, 95)) * 1e3
        return float(median), float(high)


_EVERY_S = 10.0

_LONGEST = 400
"""Characters of a line: names and numbers in messages may be of any length."""


def shortened(text: str) -> str:
    """Return a text as far as a line of a log should hold it."""
    return text if len(text) <= _LONGEST else f'{text[:_LONGEST]} ... ({len(text)} characters)'


class Warnings:
    """
    The warnings of a node, of which those of one key are logged at most every 10 seconds.

    Frames that nothing could be said of meanwhile are counted in when something is said again.
    """

    def __init__(self, log: Callable[[str], object], clock: Callable[[], float]) -> None:
        """Begin with nothing said; ``log`` takes texts, ``clock`` is steady and in seconds."""
        self._log = log
        self._clock = clock
        self._said_s: dict[str, float] = {}
        self._untold: Counter[str] = Counter()

    @property
    def keys(self) -> set[str]:
        """Return the keys of which something was said."""
        return set(self._said_s)

    def warn(self, key: str, text: str) -> bool:
        """Log a warning unless one of its key was logged just before; return whether it was."""
        now_s = self._clock()
        if now_s - self._said_s.get(key, -_EVERY_S) < _EVERY_S:
            return False
        self._said_s[key] = now_s
        self._log(shortened(text))
        return True

    def warn_of(self, frames: int, text: str) -> None:
        """
        Log a warning about some frames.

        :param text: the key as well; ``{}`` stands for these frames and those not counted before.
        """
        self._untold[text] += frames
        count = self._untold[text]
        if self.warn(text, text.format(f'{count} frame{"s" * (count != 1)}')):
            del self._untold[text]

    def warn_of_missed(self, join: ExactJoin) -> None:
        """Log warnings about frames of which not all parts have come."""
        skipped = (
            '{} said nothing of {{}} in time, so there is no result: it skipped them (its log '
            'says why), is disabled, was not there, or was later than '
            f'{join.capacity} frames that wait (keep_images of gait_segmenter)'
        )
        missed = (
            '{} did not come for {{}}: its publisher left them out, or they were lost on the way'
        )
        for text, counts in ((skipped, join.skipped), (missed, join.missed)):
            for who, count in counts.items():
                self.warn_of(count, text.format(who))
