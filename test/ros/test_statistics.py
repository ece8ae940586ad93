# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import pytest

from gait_segmentation.ros.statistics import Statistics


def test_nothing_received_is_no_rate_and_no_latency() -> None:
    statistics = Statistics()
    assert statistics.rate_hz(1.0) == 0
    assert all(math.isnan(value) for value in statistics.latency_ms())


def test_the_rate_is_that_of_the_last_seconds() -> None:
    statistics = Statistics()
    for index in range(31):
        statistics.arrived(100 + index / 30, index)
    assert statistics.rate_hz(101.0) == pytest.approx(30)
    assert statistics.rate_hz(107.0) == 0
    assert (statistics.received, statistics.last_stamp_ns) == (31, 30)


def test_latencies_are_median_and_95th_percentile() -> None:
    statistics = Statistics()
    for value in range(101):
        statistics.finished(value / 1000)
    assert statistics.latency_ms() == (pytest.approx(50), pytest.approx(95))
    assert statistics.processed == 101
