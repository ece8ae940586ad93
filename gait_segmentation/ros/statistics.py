# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Counters and times of a node, without ROS and without a clock of their own."""

from __future__ import annotations

import math
import threading
from collections import deque

import numpy as np

__all__ = ['Statistics']

_WINDOW = 150
"""Frames that rates and latencies are taken over."""


class Statistics:
    """
    What the diagnostics report of the frames of a node.

    Times are seconds of any steady clock.  May be used by several threads.
    """

    def __init__(self) -> None:
        """Begin with nothing received."""
        self.received = 0
        self.processed = 0
        self.skipped = 0
        self.failed = 0
        self.lost = 0
        self.incomplete = 0
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

    def rate_hz(self, now_s: float) -> float:
        """Return the rate of the frames of the last 5 seconds, 0 without."""
        return self._rate(self._arrivals, now_s)

    def output_rate_hz(self, now_s: float) -> float:
        """Return the rate of the outputs of the last 5 seconds, 0 without."""
        return self._rate(self._departures, now_s)

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
        """Return the frames lost, incomplete or skipped, and failed, since this was last asked."""
        now = (self.lost + self.incomplete + self.skipped, self.failed)
        before, self._told = self._told, now
        return now[0] - before[0], now[1] - before[1]

    def _rate(self, times: deque[float], now_s: float) -> float:
        with self._lock:
            recent = [each for each in times if now_s - each <= 5.0]
        if len(recent) < 2 or recent[-1] <= recent[0]:
            return 0.0
        return (len(recent) - 1) / (recent[-1] - recent[0])

    def latency_ms(self) -> tuple[float, float]:
        """Return median and 95th percentile of the time from arrival to output, NaN without."""
        with self._lock:
            values = list(self._latencies_s)
        if not values:
            return math.nan, math.nan
        median, high = np.percentile(values, (50, 95)) * 1e3
        return float(median), float(high)
