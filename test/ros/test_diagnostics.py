# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

pytest.importorskip('diagnostic_msgs', reason='needs the message packages of ROS 2')

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus

from gait_segmentation.ros.diagnostics import (
    Diagnostics,
    Statistics,
    Warnings,
    missing_input,
    no_images,
    published_twice,
)

TIME = Time(sec=10)


def told(
    statistics: Statistics,
    now_s: float = 10.0,
    now: Time = TIME,
    *,
    name: str = '/a',
    state: str = 'active',
    enabled: bool = True,
    details: dict[str, str] | None = None,
    trouble: str = '',
    missing: str = '',
) -> Any:
    """Return the status of a node's message and its values by name."""
    node = SimpleNamespace(
        statistics=statistics,
        state=state,
        enabled=enabled,
        stage=None,
        outputs=[],
        status=lambda: details or {},
        trouble=trouble,
        get_fully_qualified_name=lambda: name,
        create_publisher=lambda *_: None,
        create_timer=lambda *_, **__: None,
    )
    (status,) = Diagnostics(node).message(now_s, now, missing).status
    return status, {each.key: each.value for each in status.values}


def judged(
    statistics: Statistics, now_s: float = 10.0, state: str = 'active', **more
) -> tuple[bytes, str]:
    status, values = told(statistics, now_s, state=state, **more)
    assert values['state'] == state
    return status.level, status.message


def test_the_level_says_what_is_wrong() -> None:
    statistics = Statistics()
    assert judged(statistics) == (DiagnosticStatus.OK, 'active, no input yet')
    statistics.arrived(9.0, 9_000_000_000)
    statistics.finished(0.01, 9.01)
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    # What a node has to say is a warning where frames go well.
    why = 'located: 0 of 1, why'
    assert judged(statistics, trouble=why) == (DiagnosticStatus.WARN, why)
    statistics.stale, statistics.dropped = 3, 4
    status, values = told(statistics)
    counts = [values[name] for name in ('received', 'processed', 'dropped', 'stale', 'failed')]
    assert (status.level, counts) == (DiagnosticStatus.WARN, list('11430'))
    assert '7 frames dropped or stale' in status.message
    assert judged(statistics) == (DiagnosticStatus.OK, 'active')
    statistics.failed = 2
    assert judged(statistics, trouble=why) == (
        DiagnosticStatus.WARN,
        '2 frames could not be used since the last report',
    )
    assert judged(statistics, 15.0) == (DiagnosticStatus.STALE, 'no input for 6 s')
    for latency_s in (*[0.01] * 20, *[0.4] * 10):
        statistics.finished(latency_s, 9.5)
    assert judged(statistics) == (DiagnosticStatus.WARN, 'slow: 95 % of the outputs within 400 ms')


@pytest.mark.parametrize(
    ('stamp_ns', 'now', 'said'),
    [
        (9_000_000_000, Time(sec=10, nanosec=250_000_000), '1.250'),
        (0, Time(sec=10), 'nan'),
        # No /clock, and a stamp ahead.
        (1_700_000_000_000_000_000, Time(), 'nan'),
        (10_000_000_001, Time(sec=10), 'nan'),
    ],
)
def test_ages_are_told_where_they_make_sense(stamp_ns: int, now: Time, said: str) -> None:
    statistics = Statistics()
    statistics.arrived(9.0, stamp_ns)
    assert told(statistics, now=now)[1]['age of the last stamp (s)'] == said


def test_without_a_first_frame_a_node_is_stale_three_seconds_after_its_activation() -> None:
    statistics = Statistics()
    statistics.expect(10.0)
    assert judged(statistics, 13.0) == (DiagnosticStatus.OK, 'active, no input yet')
    assert judged(statistics, 14.0) == (DiagnosticStatus.STALE, 'no input for 4 s')
    said = judged(statistics, 14.0, missing='no node publishes /image')[1]
    assert said == 'no input for 4 s: no node publishes /image'
    assert judged(statistics, 14.0, 'inactive') == (DiagnosticStatus.OK, 'inactive')
    # Activated again.
    statistics.arrived(15.0, 1)
    statistics.expect(60.0)
    assert judged(statistics, 62.0) == (DiagnosticStatus.OK, 'active')


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


@pytest.mark.parametrize(
    ('graph', 'topic', 'text'),
    [
        (Graph(), 'image', 'no node publishes /image; start the camera, or remap image to its'),
        (
            Graph(
                cam__b=('v4l2', RAW), cam__a=('v4l2', RAW), mask=('gait_segmenter', RAW),
                depth=('v4l2', COMPRESSED),
            ),
            'image',
            'no node publishes /image, but there are images on /cam/a, /cam/b: remap image (',
        ),
        (
            Graph(image=('v4l2', RAW)),
            'image/compressed',
            'no node publishes /image/compressed, but /image is: set image_transport to raw',
        ),
        (Graph(image=('v4l2', RAW)), 'image', '/image has a publisher, but nothing comes from it'),
        (
            Graph(image=('v4l2', COMPRESSED)),
            'image',
            f'what is published on /image is {COMPRESSED}, not {RAW}',
        ),
    ],
)  # fmt: skip
def test_without_images_it_is_said_where_there_are_some(graph, topic, text) -> None:
    said = no_images(graph, topic)
    assert said.startswith('no images: ')
    assert text in said


class Waiting(Graph):
    """A node that waits for what gait_tracker publishes."""

    unstamped, join = False, None
    topics: ClassVar = {'gait_tracker': ('door/box', 'person_0/likelihood')}

    def has(self, kind: Any) -> bool:
        return False


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
