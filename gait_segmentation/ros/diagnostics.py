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
    :param state: of its life cycle.
    :param now_s: steady time in seconds.
    :param now: the node's clock.
    :param details: further keys and values.
    """
    median, high = statistics.latency_ms()
    age = math.nan
    if statistics.last_stamp_ns:
        age = now.sec + now.nanosec / 1e9 - statistics.last_stamp_ns / 1e9
    values = {
        'state': state,
        'input rate (Hz)': f'{statistics.rate_hz(now_s):.1f}',
        'received': str(statistics.received),
        'processed': str(statistics.processed),
        'skipped': str(statistics.skipped),
        'failed': str(statistics.failed),
        'latency p50 (ms)': f'{median:.1f}',
        'latency p95 (ms)': f'{high:.1f}',
        'age of the last stamp (s)': f'{age:.3f}',
        **details,
    }
    level, text = DiagnosticStatus.OK, state
    if state == 'active' and not statistics.received:
        text = 'active, no input yet'
    elif high > _LATE_MS:
        level, text = DiagnosticStatus.WARN, f'slow: 95 % of the outputs within {high:.0f} ms'
    status = DiagnosticStatus(
        level=level,
        name=name.strip('/'),
        message=text,
        hardware_id='',
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = now
    return message
