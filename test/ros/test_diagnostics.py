# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

pytest.importorskip('diagnostic_msgs', reason='needs the message packages of ROS 2')

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus

from gait_segmentation.ros.diagnostics import diagnostic_message
from gait_segmentation.streams.statistics import Statistics


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


def test_what_a_node_has_to_say_is_a_warning_where_frames_go_well() -> None:
    statistics = Statistics()
    statistics.arrived(9.0, 9_000_000_000)
    for failed, wanted in ((0, 'located: 0 of 1, why'), (1, '1 frames could not be used')):
        statistics.failed = failed
        message = diagnostic_message(
            '/a', 'active', statistics, 10.0, Time(sec=10), {}, 'located: 0 of 1, why'
        )
        assert message.status[0].level == DiagnosticStatus.WARN
        assert message.status[0].message.startswith(wanted)


@pytest.mark.parametrize(
    ('stamp_ns', 'now', 'said'),
    [
        (9_000_000_000, Time(sec=10), '1.000'),
        (0, Time(sec=10), 'nan'),
        # No /clock, a stamp of 1970 with a real clock behind, one ahead, and one below zero.
        (1_700_000_000_000_000_000, Time(), 'nan'),
        (10_000_000_001, Time(sec=10), 'nan'),
        (9_000_000_000, Time(sec=-1), 'nan'),
        (-5, Time(sec=10), 'nan'),
    ],
)
def test_ages_are_told_where_they_make_sense(stamp_ns: int, now: Time, said: str) -> None:
    statistics = Statistics()
    statistics.arrived(9.0, stamp_ns)
    message = diagnostic_message('/a', 'active', statistics, 10.0, now, {})
    values = {each.key: each.value for each in message.status[0].values}
    assert values['age of the last stamp (s)'] == said


def test_late_frames_and_those_that_come_again_are_counted() -> None:
    statistics = Statistics()
    statistics.arrived(9.0, 1)
    statistics.again = 5
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    statistics.late = 3
    message = diagnostic_message('/a', 'active', statistics, 10.0, Time(sec=10), {})
    values = {each.key: each.value for each in message.status[0].values}
    assert (values['late'], values['again']) == ('3', '5')
    assert message.status[0].level == DiagnosticStatus.WARN
    assert '3 frames lost, skipped or late' in message.status[0].message


def test_without_a_first_frame_a_node_is_stale_three_seconds_after_its_activation() -> None:
    statistics = Statistics()
    statistics.expect(10.0)
    assert judged(statistics, 13.0) == (DiagnosticStatus.OK, 'active, no input yet')
    assert judged(statistics, 14.0) == (DiagnosticStatus.STALE, 'no input for 4 s')
    message = diagnostic_message(
        '/a', 'active', statistics, 14.0, Time(sec=10), {}, missing='nobody publishes /image'
    )
    assert message.status[0].message == 'no input for 4 s: nobody publishes /image'
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
