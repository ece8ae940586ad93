# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A node lives with whatever the clock says."""

from __future__ import annotations

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from gait_segmentation.nodes.pipeline_node import PipelineNode
from test.nodes.bench import Bench, frame

AGE = 'age of the last stamp (s)'


def ages(reports: list[DiagnosticArray]) -> list[str]:
    return [each.value for m in reports for each in m.status[0].values if each.key == AGE]


@pytest.mark.parametrize(
    ('times', 'warning', 'age'),
    [
        ([], 'no time', 'nan'),
        ([Time(sec=-1)], 'clock', 'nan'),
        ([Time(sec=50)], None, 'nan'),
        ([Time(sec=103), Time(sec=-5, nanosec=7)], 'clock', '2.967'),
    ],
    ids=['none', 'below zero', 'behind', 'below zero later'],
)
def test_a_node_lives_and_warns(
    bench: Bench,
    times: list[Time],
    warning: str | None,
    age: str,
) -> None:
    node = bench.add(PipelineNode, use_sim_time=True)
    bench.record_outputs('mask')
    reports = bench.record(DiagnosticArray, '/diagnostics')
    clock = bench.publisher(Clock, '/clock', 1)
    for each in times:
        clock.publish(Clock(clock=each))
        bench.settle()
    camera = bench.publisher(Image, 'image', 1)
    bench.feed(camera, [frame(0), frame(1)])
    reports.clear()
    bench.until(lambda: len(reports) > 1, 'diagnostics')
    assert node.state == 'active'
    assert {*node.warnings.keys} & {'clock', 'no time'} >= ({warning} if warning else set())
    assert ages(reports)[-1][:5] == age
    assert all(m.header.stamp.sec >= 0 for m in reports)
