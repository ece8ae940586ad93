# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a node is doing: counters and times of frames, warnings that do not flood the log."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

import numpy as np

_WINDOW = 150
"""Frames that rates and latencies are taken over."""

_RECENT_S = 5.0
"""Time that rates are taken over."""

_EVERY_S = 10.0

_LONGEST = 400
"""Characters of a line: names and numbers in messages may be of any length."""


class Statistics:
    """What is known of the frames of a node; times are seconds of any steady clock."""

    def __init__(self) -> None:
        """Begin with nothing received."""
        self.received = self.processed = self.failed = self.dropped = self.stale = 0
        self.last_stamp_ns = 0
        self._arrivals: deque[float] = deque(maxlen=_WINDOW)
        self._departures: deque[float] = deque(maxlen=_WINDOW)
        self._latencies_s: deque[float] = deque(maxlen=_WINDOW)
        self._told = (0, 0)
        self._since_s = math.nan

    def arrived(self, now_s: float, stamp_ns: int) -> None:
        """Count a frame received."""
        self.received += 1
        self.last_stamp_ns = stamp_ns
        self._arrivals.append(now_s)

    def finished(self, latency_s: float, now_s: float = 0.0) -> None:
        """Count a frame whose output is published, ``latency_s`` after its arrival."""
        self.processed += 1
        self._latencies_s.append(latency_s)
        self._departures.append(now_s)

    def rates_hz(self, now_s: float) -> tuple[float, float]:
        """Return the rates of frames and of outputs over the last 5 seconds, 0 without."""

        def rate(all_times: deque[float]) -> float:
            times = [each for each in list(all_times) if now_s - each <= _RECENT_S]
            if not times or times[-1] <= times[0]:
                return 0.0
            return (len(times) - 1) / (times[-1] - times[0])

        return rate(self._arrivals), rate(self._departures)

    def expect(self, now_s: float) -> None:
        """Note that frames are to come from now on."""
        self._since_s = now_s

    def quiet_s(self, now_s: float) -> float:
        """Return the time for which frames were to come and none did, NaN if none are to."""
        last_s = self._arrivals[-1] if self._arrivals else math.nan
        # NaN gives way to the other.
        return now_s - float(np.fmax(last_s, self._since_s))

    def losses(self) -> tuple[int, int]:
        """Return the frames dropped or stale, and those that failed, since last asked."""
        now = (self.dropped + self.stale, self.failed)
        before, self._told = self._told, now
        return now[0] - before[0], now[1] - before[1]

    def latency_ms(self) -> tuple[float, float]:
        """Return median and 95th percentile of the time from arrival to output, NaN without."""
        median, high = np.percentile(list(self._latencies_s) or [math.nan], (50, 95)) * 1e3
        return float(median), float(high)


def shortened(text: str) -> str:
    """Return a text as far as a line of a log should hold it."""
    return text if len(text) <= _LONGEST else f'{text[:_LONGEST]} ... ({len(text)} characters)'


class Warnings:
    """The warnings of a node, of which those of one key are logged at most every 10 seconds."""

    def __init__(self, log: Callable[[str], object], clock: Callable[[], float]) -> None:
        """Begin with nothing said; ``log`` takes texts, ``clock`` is steady and in seconds."""
        self._log = log
        self._clock = clock
        self._said_s: dict[str, float] = {}

    @property
    def keys(self) -> set[str]:
        """Return the keys of which something was said."""
        return set(self._said_s)

    def warn(self, key: str, text: str) -> None:
        """Log a warning unless one of its key was logged just before."""
        now_s = self._clock()
        if now_s - self._said_s.get(key, -_EVERY_S) >= _EVERY_S:
            self._said_s[key] = now_s
            self._log(shortened(text))
