# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters as ROS sees them: types, words of YAML, and when they may be changed."""

from __future__ import annotations

from typing import Any

import pytest
from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter

from gait_segmentation.errors import ConfigError
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.people import PeopleConfig
from gait_segmentation.streams.config import NodeConfig
from gait_segmentation.tracking import TrackingConfig
from test.nodes.bench import Bench


def put(node: Any, name: str, value: Any) -> str:
    """Set a parameter and return why not, empty if it is set."""
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert result.successful is not bool(result.reason)
    return str(result.reason)


def shown(node: Any, name: str) -> tuple[int, Any]:
    """Return type and value of a parameter, as it is described and as it is."""
    value = node.get_parameter(name).get_parameter_value()
    assert node.describe_parameter(name).type == value.type
    return value.type, node.get_parameter(name).value


def test_integers_given_to_numbers_become_numbers(bench: Bench) -> None:
    node = bench.add(
        TrackerNode,
        start=False,
        initial_box=[1, 2, 3, 4],
        **{'tracking.colour_rate': 1, 'max_people': 2},
    )
    double, doubles = ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_DOUBLE_ARRAY
    assert shown(node, 'tracking.colour_rate') == (double, 1.0)
    assert shown(node, 'max_people') == (ParameterType.PARAMETER_INTEGER, 2)
    assert shown(node, 'initial_box')[0] == doubles
    assert list(shown(node, 'initial_box')[1]) == [1.0, 2.0, 3.0, 4.0]
    assert put(node, 'tracking.colour_rate', 0) == ''
    assert shown(node, 'tracking.colour_rate') == (double, 0.0)
    assert node.parameters.get(TrackingConfig).colour_rate == 0.0
    # A refusal leaves the type as it was, too.
    assert put(node, 'tracking.colour_rate', 'much')
    assert put(node, 'tracking.colour_rate', 2)
    assert shown(node, 'tracking.colour_rate') == (double, 0.0)
    (given,) = node.describe_parameter('tracking.colour_rate').floating_point_range
    assert (given.from_value, given.to_value) == (0.0, 1.0)


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('max_people', 17, 'max_people must be an integer from 1 to 16, got 17'),
        ('initial_box', [1, 2, 3], 'must be 4 finite numbers, got [1.0, 2.0, 3.0]'),
        ('initial_box', [1.0, 2.0, 3.0, -4.0], 'initial_box: '),
    ],
)
def test_first_values_that_are_not_allowed_are_refused(
    bench: Bench, name: str, value: Any, reason: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        bench.add(TrackerNode, start=False, **{name: value})
    assert reason in str(caught.value)


def test_switches_of_mechanisms_are_parameters_where_a_file_sets_them(bench: Bench) -> None:
    arguments = ['--ros-args', '-p', 'tracking.use_tilt:=false']
    bench.nodes.append(TrackerNode(context=bench.context, cli_args=arguments))
    (node,) = bench.nodes
    config = node.parameters.get(TrackingConfig)
    assert (config.use_tilt, config.use_shadow) == (False, True)
    assert [node.has_parameter(f'tracking.use_{name}') for name in ('tilt', 'shadow')] == [
        True,
        False,
    ]


def test_what_is_fixed_can_be_changed_while_the_node_is_unconfigured(bench: Bench) -> None:
    node = bench.add(TrackerNode)
    refusal = 'max_people is read when the node is configured, and it is {}: deactivate it and'
    assert put(node, 'max_people', 3).startswith(refusal.format('active'))
    # As a file that was dumped gives it back.
    assert put(node, 'max_people', 1) == ''
    node.trigger_deactivate()
    assert put(node, 'max_people', 3).startswith(refusal.format('inactive'))
    assert node.parameters.get(PeopleConfig).max_people == 1
    node.trigger_cleanup()
    assert put(node, 'max_people', 3) == ''
    assert put(node, 'max_people', 99)
    assert put(node, 'image_transport', 'compressed') == ''
    assert put(node, 'initial_box', [1, 2, 3]).startswith('initial_box must be 4 finite numbers')
    assert put(node, 'initial_box', [30, 20, 24, 80]) == ''
    assert node.start()
    topics = {each.topic_name for each in node.outputs}
    assert '/person_2/box' in topics
    assert '/person_3/box' not in topics
    assert node.camera_topic == '/image/compressed'


def test_what_is_read_when_a_node_starts_stays(bench: Bench) -> None:
    node = bench.add(SegmenterNode, start=False)
    assert 'read-only' in put(node, 'autostart', False)
    assert node.parameters.get(NodeConfig).autostart
