# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

pytest.importorskip('diagnostic_msgs', reason='needs the message packages of ROS 2')

from diagnostic_msgs.msg import DiagnosticStatus

from gait_segmentation.ros.diagnostics import (
    Diagnostics,
    Statistics,
    Warnings,
    missing_input,
    published_twice,
)

LOGGED: list[str] = []


def reporting(
    statistics: Statistics,
    *,
    state: str = 'active',
    enabled: bool = True,
    details: dict[str, str] | None = None,
    trouble: str = '',
    load: tuple[float, float] = (0.0, 0.0),
) -> Diagnostics:
    """Return what reports on a node whose images have no stamps."""
    node = SimpleNamespace(
        statistics=statistics,
        state=state,
        enabled=enabled,
        stage=None,
        outputs=[],
        status=lambda: details or {},
        trouble=trouble,
        frame_times_s=load,
        get_fully_qualified_name=lambda: '/a',
        get_logger=lambda: SimpleNamespace(warning=LOGGED.append),
        unstamped=True,
        create_publisher=lambda *_: None,
        create_timer=lambda *_, **__: None,
    )
    return Diagnostics(node)


def told(statistics: Statistics, now_s: float = 10.0, **node: Any) -> Any:
    """Return the status of a node's message and its values by name."""
    status = reporting(statistics, **node).status(now_s)
    return status, {each.key: each.value for each in status.values}


def judged(
    statistics: Statistics, now_s: float = 10.0, state: str = 'active', **more
) -> tuple[bytes, str]:
    status, values = told(statistics, now_s, state=state, **more)
    assert values['state'] == state
    return status.level, status.message


def test_the_level_says_what_is_wrong() -> None:
    statistics = Statistics()
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    statistics.arrived(9.0, 9_000_000_000)
    statistics.finished(0.01, 9.01)
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    # What a node has to say is a warning where frames go well.
    why = 'located: 0 of 1, why'
    assert judged(statistics, trouble=why) == (DiagnosticStatus.WARN, why)
    level, text = judged(statistics, load=(0.048, 0.033))
    assert level == DiagnosticStatus.OK
    assert 'frames take 48 ms and come every 33' in text
    assert 'detector.network: boxes' in text
    assert judged(statistics, load=(0.03, 0.033)) == (DiagnosticStatus.OK, 'active')
    statistics.stale, statistics.dropped = 3, 4
    status, values = told(statistics)
    counts = [values[name] for name in ('received', 'processed', 'dropped', 'stale', 'failed')]
    assert (status.level, counts) == (DiagnosticStatus.OK, list('11430'))
    assert (values['latency p95 (ms)'], values['last stamp (s)']) == ('10.0', '9.000')
    said = judged(statistics, 15.0, trouble=why)
    assert said == (DiagnosticStatus.STALE, 'no input for 6 s: what comes has no stamp')
    assert not LOGGED
    judged(statistics, 20.0)
    assert LOGGED.pop() == 'what comes has no stamp'


def test_without_a_first_frame_a_node_is_stale_three_seconds_after_its_activation() -> None:
    statistics = Statistics()
    statistics.expect(10.0)
    assert judged(statistics, 13.0) == (DiagnosticStatus.OK, 'active')
    assert judged(statistics, 14.0)[0] == DiagnosticStatus.STALE
    assert judged(statistics, 14.0, 'inactive') == (DiagnosticStatus.OK, 'inactive')
    # Activated again.
    statistics.arrived(15.0, 1)
    statistics.expect(60.0)
    assert judged(statistics, 62.0) == (DiagnosticStatus.OK, 'active')


def test_what_is_missing_is_logged_once_each_time_that_it_is() -> None:
    statistics = Statistics()
    statistics.expect(10.0)
    report = reporting(statistics).status
    for logged in (1, 2):
        for seconds in (3.5, 10.5, 11.5):
            report(10.0 * logged + seconds)
        assert len(LOGGED) == logged
        statistics.arrived(20.0, 1)
        report(22.0)
    LOGGED.clear()


@pytest.mark.parametrize(('state', 'enabled'), [('active', False), ('inactive', True)])
def test_a_node_that_expects_nothing_is_not_stale(state: str, enabled: bool) -> None:
    statistics = Statistics()
    statistics.expect(1.0)
    for now_s in (10.0, 60.0):
        status, values = told(statistics, now_s, state=state, enabled=enabled)
        assert values['state'] == status.message == state + ', disabled' * (not enabled)
        assert status.level == DiagnosticStatus.OK
        statistics.arrived(9.0, 9_000_000_000)


RAW, COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'


class Graph:
    """What a node sees of the graph: the publishers of each topic."""

    def __init__(self, **publishers: tuple[str, str]) -> None:
        self._publishers = {
            '/' + name.replace('__', '/'): [SimpleNamespace(node_name=node, topic_type=kind)]
            for name, (node, kind) in publishers.items()
        }

    def resolve_topic_name(self, name: str) -> str:
        return {'door/box': '/person_0/box'}.get(name, f'/{name}')

    def count_publishers(self, name: str) -> int:
        return len(self.get_publishers_info_by_topic(name))

    def get_publishers_info_by_topic(self, name: str) -> list[SimpleNamespace]:
        return self._publishers.get(name, [])

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [(n, [p.topic_type for p in found]) for n, found in self._publishers.items()]


class Waiting(Graph):
    """A node that waits for what gait_tracker publishes."""

    unstamped, join = False, None
    topics: ClassVar = {'gait_tracker': ('door/box', 'person_0/likelihood')}

    def has(self, kind: Any) -> bool:
        return False


class Seeing(Waiting):
    """A node that waits for a camera."""

    topics: ClassVar = {}
    camera_topic = 'image'

    def has(self, kind: Any) -> bool:
        return True


def test_without_images_it_is_said_where_there_are_some() -> None:
    text = 'no images come on /image'
    assert missing_input(Seeing()).startswith(f'{text}: start the camera')
    graph = Seeing(
        cam__b=('v4l2', RAW), cam__a=('v4l2', COMPRESSED), mask=('gait_segmenter', RAW),
        scan=('lidar', 'sensor_msgs/msg/LaserScan'),
    )  # fmt: skip
    said = f'{text}, there are /cam/a ({COMPRESSED}), /cam/b ({RAW}): remap image ('
    assert missing_input(graph).startswith(said)


def test_images_that_are_announced_where_they_are_awaited_may_be_lost() -> None:
    text = 'no images come on /image'
    assert missing_input(Seeing(image=('v4l2', RAW))).startswith(
        f'{text}, though a node publishes'
    )
    # Of another type they are not what is awaited.
    other = missing_input(Seeing(image=('v4l2', COMPRESSED)))
    assert other.startswith(f'{text}, there are /image ({COMPRESSED}): remap')
    node = Seeing(image__compressed=('v4l2', COMPRESSED))
    node.camera_topic = 'image/compressed'
    assert 'though a node publishes there' in missing_input(node)


def test_topics_that_nobody_publishes_are_named_with_who_should() -> None:
    assert missing_input(Waiting(person_0__box=('other', 'x'))) == (
        'nothing to do: no node publishes /person_0/likelihood; is gait_tracker running and '
        'active?'
    )
    both = Waiting(person_0__box=('other', 'x'), person_0__likelihood=('other', 'x'))
    assert 'nothing comes from gait_tracker' in missing_input(both)


@pytest.mark.parametrize(
    ('others', 'said'),
    [
        ([], ''),
        ([('old', '/'), ('new', '/robot')], '/old and /robot/new publishes /mask, too'),
        ([('gait_pipeline', '/')], 'another /gait_pipeline publishes /mask, too'),
    ],
)
def test_who_publishes_the_same_is_named(others: list[tuple[str, str]], said: str) -> None:
    found = [
        SimpleNamespace(node_name=name, node_namespace=space)
        for name, space in [('gait_pipeline', '/'), *others]
    ]
    node = SimpleNamespace(
        outputs=[SimpleNamespace(topic_name='/mask')],
        get_fully_qualified_name=lambda: '/gait_pipeline',
        count_publishers=lambda topic: len(found),
        get_publishers_info_by_topic=lambda topic: found,
    )
    assert published_twice(node).startswith(said)
    assert bool(published_twice(node)) == bool(said)


def test_rates_are_those_of_the_last_seconds() -> None:
    statistics = Statistics()
    for index in range(31):
        statistics.arrived(100 + index / 30, index)
        statistics.finished(0.01, 100 + index / 10)
    assert statistics.rates_hz(103.0) == (pytest.approx(30), pytest.approx(10))
    assert statistics.rates_hz(120.0) == (0, 0)
    assert (statistics.received, statistics.last_stamp_ns) == (31, 30)


def test_latencies_are_median_and_95th_percentile() -> None:
    statistics = Statistics()
    for value in range(101):
        statistics.finished(value / 1000)
    assert statistics.latency_ms() == (pytest.approx(50), pytest.approx(95))
    assert statistics.processed == 101


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
    assert log.warnings.said_s.keys() == {'a', 'b'}


def test_a_line_of_the_log_is_short_whatever_names_are_in_it() -> None:
    log = Log((0.0,))
    log.warnings.warn('names', f'got {["x" * 50_000]}')
    (said,) = log.said
    assert len(said) < 500
    assert said.startswith('got [')
    assert said.endswith('(50008 characters)')


def test_it_is_quiet_since_the_last_frame_or_since_frames_are_to_come() -> None:
    statistics = Statistics()
    statistics.expect(10.0)
    assert statistics.quiet_s(13.0) == 3.0
    for now_s in (14.0, 15.0, 16.0):
        statistics.arrived(now_s, 5)
    assert statistics.quiet_s(18.0) == 2.0
    statistics.expect(17.0)
    assert statistics.quiet_s(18.0) == 1.0
