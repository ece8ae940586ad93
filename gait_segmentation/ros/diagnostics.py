# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Counters and times of a node, without a clock of their own, and the diagnostics they make."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Mapping

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

__all__ = ['Statistics', 'diagnostic_message']

_WINDOW = 150
"""Frames that rates and latencies are taken over."""

_LATE_MS = 250.0
"""Latency (95th percentile) above which a node warns."""

_QUIET_S = 3.0
"""Time without input after which a node is stale."""


class Statistics:
    """
    What is known of the frames of a node.

    Times are seconds of any steady clock.  May be used by several threads.
    """

    def __init__(self) -> None:
        """Begin with nothing received."""
        self.received = self.processed = self.skipped = self.failed = 0
        self.lost = self.incomplete = self.late = self.again = 0
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
                [each for each in times if now_s - each <= 5.0]
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
        """Return the frames lost, incomplete, skipped or late, and failed, since last asked."""
        now = (self.lost + self.incomplete + self.skipped + self.late, self.failed)
        before, self._told = self._told, now
        return now[0] - before[0], now[1] - before[1]

    def latency_ms(self) -> tuple[float, float]:
        """Return median and 95th percentile of the time from arrival to output, NaN without."""
        with self._lock:
            values = list(self._latencies_s) or [math.nan]
        median, high = np.percentile(values, (50, 95)) * 1e3
        return float(median), float(high)


def diagnostic_message(
    name: str,
    state: str,
    statistics: Statistics,
    now_s: float,
    now: Time,
    details: Mapping[str, str],
    trouble: str = '',
) -> DiagnosticArray:
    """
    Describe how a node is doing.

    :param name: full name of the node.
    :param state: what it does, ``active`` if it is to work on frames.
    :param now_s: steady time in seconds, ``now`` the node's clock.
    :param details: further keys and values; ``camera``, or else the node, is the hardware.
    :param trouble: what to warn of if frames go well, empty if there is nothing.
    """
    median, high = statistics.latency_ms()
    frames, outputs = statistics.rates_hz(now_s)
    age = _age_s(statistics.last_stamp_ns, now)
    values = {
        'state': state,
        'input rate (Hz)': f'{frames:.1f}',
        'output rate (Hz)': f'{outputs:.1f}',
        'received': str(statistics.received),
        'processed': str(statistics.processed),
        'skipped': str(statistics.skipped),
        'failed': str(statistics.failed),
        'lost on the wire': str(statistics.lost),
        'incomplete': str(statistics.incomplete),
        'late': str(statistics.late),
        'again': str(statistics.again),
        'latency p50 (ms)': f'{median:.1f}',
        'latency p95 (ms)': f'{high:.1f}',
        'age of the last stamp (s)': f'{age:.3f}',
        **details,
    }
    level, text = _judged(state, statistics, now_s, high, trouble)
    status = DiagnosticStatus(
        level=level,
        name=name.strip('/'),
        message=text,
        hardware_id=details.get('camera', name.strip('/')),
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = now
    return message


def _age_s(stamp_ns: int, now: Time) -> float:
    """Return how old a stamp is, NaN without it or a time, or if it is ahead of that."""
    now_ns = now.sec * 1_000_000_000 + now.nanosec
    age_s = (now_ns - stamp_ns) / 1e9
    return age_s if stamp_ns > 0 and now_ns > 0 and age_s >= 0 else math.nan


def _judged(
    state: str, statistics: Statistics, now_s: float, late_ms: float, trouble: str
) -> tuple[bytes, str]:
    """Return the level and what it is for; nothing is expected of a node that is not active."""
    losses, failures = statistics.losses()
    if state == 'active' and statistics.quiet_s(now_s) > _QUIET_S:
        return DiagnosticStatus.STALE, f'no input for {statistics.quiet_s(now_s):.0f} s'
    if state == 'active' and not statistics.received:
        return DiagnosticStatus.OK, 'active, no input yet'
    if failures:
        return DiagnosticStatus.WARN, f'{failures} frames could not be used since the last report'
    if losses:
        return (
            DiagnosticStatus.WARN,
            f'{losses} frames lost, skipped or late since the last report',
        )
    if late_ms > _LATE_MS:
        return DiagnosticStatus.WARN, f'slow: 95 % of the outputs within {late_ms:.0f} ms'
    if trouble:
        return DiagnosticStatus.WARN, trouble
    return DiagnosticStatus.OK, state
