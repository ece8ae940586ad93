# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math
from collections.abc import Iterable

import pytest

from gait_segmentation.streams.config import misnamed
from gait_segmentation.streams.health import Statistics, Warnings


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
    statistics.dropped, statistics.stale = 2, 3
    statistics.failed = 4
    assert [statistics.losses(), statistics.losses()] == [(5, 4), (0, 0)]
    for index in range(5):
        statistics.finished(0.01, 3.0 + 0.1 * index)
    assert statistics.rates_hz(4.0)[1] == pytest.approx(10)
    assert statistics.rates_hz(40.0)[1] == 0


class Log:
    """Warnings at given times, and what was logged."""

    def __init__(self, times: Iterable[float]) -> None:
        self.said: list[str] = []
        clock = iter(times)
        self.warnings = Warnings(self.said.append, lambda: next(clock))


def test_warnings_of_one_key_are_at_least_10_seconds_apart() -> None:
    log = Log((0.1, 1.0, 2.0, 10.0, 10.2, 20.1, 20.3))
    texts = [('a', 'first'), ('b', 'other'), *(('a', text) for text in ('2', '3', '4', '5', '6'))]
    for each in texts:
        log.warnings.warn(*each)
    assert log.said == ['first', 'other', '4', '6']
    assert log.warnings.keys == {'a', 'b'}


def test_a_line_of_the_log_is_short_whatever_names_are_in_it() -> None:
    log = Log((0.0,))
    log.warnings.warn('names', f'got {["x" * 50_000]}')
    (said,) = log.said
    assert len(said) < 500
    assert said.startswith('got [')
    assert said.endswith('(50008 characters)')


KNOWN = ['max_people', 'backlog', 'initial_box', 'tracking.use_background', 'tracking.memory']


@pytest.mark.parametrize(
    ('given', 'found'),
    [
        ('max_peeple', {'max_peeple': 'max_people'}),
        ('tracking.use_backgrund', {'tracking.use_backgrund': 'tracking.use_background'}),
        ('tracking.nothing_of_the_kind', {'tracking.nothing_of_the_kind': ''}),
        ('traking.memori', {'traking.memori': 'tracking.memory'}),
        ('people.max_people', {'people.max_people': 'max_people'}),
        ('use_background', {'use_background': 'tracking.use_background'}),
        # Those of ROS and of others.
        *((name, {}) for name in ('use_sim_time', 'matching.lag', 'matching.memory', 'lag')),
        ('qos_overrides./image.subscription.backlog', {}),
    ],
)
def test_what_is_nearly_a_parameter_is_found(given: str, found: dict[str, str]) -> None:
    assert misnamed(['backlog', given], KNOWN) == found
