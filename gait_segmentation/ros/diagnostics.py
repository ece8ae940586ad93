# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The diagnostics of a node as a message."""

from __future__ import annotations

import math
from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from gait_segmentation.ros.statistics import Statistics

__all__ = ['diagnostic_message']

_LATE_MS = 250.0
"""Latency (95th percentile) above which a node warns."""

_QUIET_S = 3.0
"""Time without input after which a node is stale."""


def diagnostic_message(
    name: str,
    state: str,
    statistics: Statistics,
    now_s: float,
    now: Time,
    details: Mapping[str, str],
) -> DiagnosticArray:
    """
    Describe how a node is doing.

    :param name: full name of the node.
    :param state: what it does, ``active`` if it is to work on frames.
    :param now_s: steady time in seconds.
    :param now: the node's clock.
    :param details: further keys and values; ``camera``, or else the node, is the hardware.
    """
    median, high = statistics.latency_ms()
    age = math.nan
    if statistics.last_stamp_ns:
        age = now.sec + now.nanosec / 1e9 - statistics.last_stamp_ns / 1e9
    values = {
        'state': state,
        'input rate (Hz)': f'{statistics.rate_hz(now_s):.1f}',
        'output rate (Hz)': f'{statistics.output_rate_hz(now_s):.1f}',
        'received': str(statistics.received),
        'processed': str(statistics.processed),
        'skipped': str(statistics.skipped),
        'failed': str(statistics.failed),
        'lost on the wire': str(statistics.lost),
        'incomplete': str(statistics.incomplete),
        'latency p50 (ms)': f'{median:.1f}',
        'latency p95 (ms)': f'{high:.1f}',
        'age of the last stamp (s)': f'{age:.3f}',
        **details,
    }
    level, text = _judged(state, statistics, now_s, high)
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


def _judged(state: str, statistics: Statistics, now_s: float, late_ms: float) -> tuple[bytes, str]:
    """Return the level and what it is for; nothing is expected of a node that is not active."""
    losses, failures = statistics.losses()
    if state == 'active' and statistics.quiet_s(now_s) > _QUIET_S:
        return DiagnosticStatus.STALE, f'no input for {statistics.quiet_s(now_s):.0f} s'
    if state == 'active' and not statistics.received:
        return DiagnosticStatus.OK, 'active, no input yet'
    if failures:
        return DiagnosticStatus.WARN, f'{failures} frames could not be used since the last report'
    if losses:
        return DiagnosticStatus.WARN, f'{losses} frames lost or skipped since the last report'
    if late_ms > _LATE_MS:
        return DiagnosticStatus.WARN, f'slow: 95 % of the outputs within {late_ms:.0f} ms'
    return DiagnosticStatus.OK, state
