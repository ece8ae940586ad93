# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

pytest.importorskip('diagnostic_msgs', reason='needs the message packages of ROS 2')

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus

from gait_segmentation.ros.diagnostics import diagnostic_message
from gait_segmentation.ros.statistics import Statistics


def judged(
    statistics: Statistics, now_s: float = 10.0, state: str = 'active'
) -> tuple[bytes, str]:
    message = diagnostic_message('/a', state, statistics, now_s, Time(sec=10), {})
    (status,) = message.status
    assert {each.key: each.value for each in status.values}['state'] == state
    return status.level, status.message


def test_the_hardware_is_the_camera_or_else_the_node() -> None:
    def hardware(details: dict[str, str]) -> str:
        message = diagnostic_message('/r/a', 'active', Statistics(), 1.0, Time(sec=10), details)
        return str(message.status[0].hardware_id)

    assert hardware({'camera': '/camera/image_raw'}) == '/camera/image_raw'
    assert hardware({}) == 'r/a'


def test_the_level_says_what_is_wrong() -> None:
    statistics = Statistics()
    assert judged(statistics) == (DiagnosticStatus.OK, 'active, no input yet')
    statistics.arrived(9.0, 9_000_000_000)
    statistics.finished(0.01, 9.01)
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    statistics.lost = 4
    assert judged(statistics)[0] == DiagnosticStatus.WARN
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    statistics.failed = 2
    assert judged(statistics) == (
        DiagnosticStatus.WARN,
        '2 frames could not be used since the last report',
    )
    assert judged(statistics, 15.0) == (DiagnosticStatus.STALE, 'no input for 6 s')
    for _ in range(30):
        statistics.finished(0.4, 9.5)
    assert judged(statistics) == (DiagnosticStatus.WARN, 'slow: 95 % of the outputs within 400 ms')


def test_without_a_first_frame_a_node_is_stale_three_seconds_after_its_activation() -> None:
    statistics = Statistics()
    statistics.expect(10.0)
    assert judged(statistics, 13.0) == (DiagnosticStatus.OK, 'active, no input yet')
    assert judged(statistics, 14.0) == (DiagnosticStatus.STALE, 'no input for 4 s')
    assert judged(statistics, 14.0, 'inactive') == (DiagnosticStatus.OK, 'inactive')
    # Activated again.
    statistics.arrived(15.0, 1)
    statistics.expect(60.0)
    assert judged(statistics, 62.0) == (DiagnosticStatus.OK, 'active')


@pytest.mark.parametrize('state', ['active, disabled', 'inactive'])
def test_a_node_that_expects_nothing_is_not_stale(state: str) -> None:
    statistics = Statistics()
    statistics.expect(1.0)
    assert judged(statistics, 10.0, state) == (DiagnosticStatus.OK, state)
    statistics.arrived(9.0, 9_000_000_000)
    assert judged(statistics, 60.0, state) == (DiagnosticStatus.OK, state)
