# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the diagnostics say of a node."""

from __future__ import annotations

import math
from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from gait_segmentation.streams.health import Statistics

_LATE_MS = 250.0
"""Latency (95th percentile) above which a node warns."""

QUIET_S = 3.0
"""Time without input after which a node is stale."""


def diagnostic_message(
    name: str,
    state: str,
    statistics: Statistics,
    now_s: float,
    now: Time,
    details: Mapping[str, str],
    trouble: str = '',
    missing: str = '',
) -> DiagnosticArray:
    """
    Describe how a node is doing.

    :param name: full name of the node.
    :param state: what it does, ``active`` if it is to work on frames.
    :param now_s: steady time in seconds, ``now`` the node's clock.
    :param details: further keys and values; ``camera``, or else the node, is the hardware.
    :param trouble: what to warn of if frames go well, empty if there is nothing.
    :param missing: what a node that is stale waits for, empty if that is not known.
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
    level, text = _judged(state, statistics, now_s, high, trouble, missing)
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
    state: str, statistics: Statistics, now_s: float, late_ms: float, trouble: str, missing: str
) -> tuple[bytes, str]:
    """Return the level and what it is for; nothing is expected of a node that is not active."""
    losses, failures = statistics.losses()
    if state == 'active' and statistics.quiet_s(now_s) > QUIET_S:
        text = f'no input for {statistics.quiet_s(now_s):.0f} s'
        return DiagnosticStatus.STALE, text + f': {missing}' * bool(missing)
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
