# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import pytest

from gait_segmentation.streams.statistics import Statistics


def test_nothing_received_is_no_rate_and_no_latency() -> None:
    statistics = Statistics()
    assert statistics.rates_hz(1.0) == (0, 0)
    assert all(math.isnan(value) for value in statistics.latency_ms())


def test_the_rate_is_that_of_the_last_seconds() -> None:
    statistics = Statistics()
    for index in range(31):
        statistics.arrived(100 + index / 30, index)
    assert statistics.rates_hz(101.0)[0] == pytest.approx(30)
    assert statistics.rates_hz(107.0)[0] == 0
    assert (statistics.received, statistics.last_stamp_ns) == (31, 30)


def test_latencies_are_median_and_95th_percentile() -> None:
    statistics = Statistics()
    for value in range(101):
        statistics.finished(value / 1000)
    assert statistics.latency_ms() == (pytest.approx(50), pytest.approx(95))
    assert statistics.processed == 101


def test_losses_are_told_once_and_silence_is_measured() -> None:
    statistics = Statistics()
    assert math.isnan(statistics.quiet_s(5.0))
    statistics.expect(1.0)
    assert statistics.quiet_s(5.0) == 4.0
    statistics.arrived(2.0, 1)
    assert statistics.quiet_s(5.0) == 3.0
    statistics.expect(4.0)
    assert statistics.quiet_s(5.0) == 1.0
    statistics.lost, statistics.skipped = 2, 3
    statistics.failed = 4
    assert [statistics.losses(), statistics.losses()] == [(5, 4), (0, 0)]
    for index in range(5):
        statistics.finished(0.01, 3.0 + 0.1 * index)
    assert statistics.rates_hz(4.0)[1] == pytest.approx(10)
    assert statistics.rates_hz(40.0)[1] == 0
