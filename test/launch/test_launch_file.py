# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The launch file; a robot has launch and launch_ros from apt, there are no wheels of them."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip('launch_ros', reason='needs the packages launch and launch_ros')

from launch.launch_description_sources import (
    get_launch_description_from_python_launch_file,
)
from launch_ros.actions import Node

import launch

FILE = Path(__file__).parents[2] / 'launch/gait_segmentation.launch.py'
SPLIT = ['gait_tracker', 'gait_matcher', 'gait_segmenter']


def started(**arguments: str) -> list[str]:
    """Return the nodes that would be started."""
    description = get_launch_description_from_python_launch_file(str(FILE))
    context = launch.LaunchContext()
    for argument in description.get_launch_arguments():
        default = argument.default_value
        assert argument.description
        context.launch_configurations[argument.name] = ''.join(
            part.perform(context) for part in default
        )
    assert set(arguments) <= set(context.launch_configurations)
    context.launch_configurations.update(arguments)
    return [
        action.node_executable
        for action in description.entities
        if isinstance(action, Node) and action.condition.evaluate(context)
    ]


def test_three_nodes_are_started_by_default() -> None:
    assert started() == SPLIT
    assert started(style='split', image='/camera/image_raw', namespace='robot') == SPLIT


def test_one_node_is_started_if_asked_for() -> None:
    assert started(style='single') == ['gait_pipeline']


def test_the_parameter_file_exists() -> None:
    description = get_launch_description_from_python_launch_file(str(FILE))
    (argument,) = (a for a in description.get_launch_arguments() if a.name == 'params_file')
    assert Path(argument.default_value[0].text).is_file()
