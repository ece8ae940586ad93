# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Start the three nodes, or gait_pipeline in their place, on a camera topic."""

import os

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from gait_segmentation.ros.files import shared_file, use_shared_memory
from launch import LaunchDescription

PACKAGE = 'gait_segmentation'


def generate_launch_description():
    """Return what ``ros2 launch`` is to do."""
    arguments = [
        DeclareLaunchArgument(
            'style',
            default_value='split',
            choices=['split', 'single'],
            description='split = tracker, matcher and segmenter as processes of their own; '
            'single = gait_pipeline, one process with the least latency',
        ),
        DeclareLaunchArgument(
            'image', default_value='image', description='topic of the camera images'
        ),
        DeclareLaunchArgument(
            'namespace', default_value='', description='namespace of all nodes and topics'
        ),
        DeclareLaunchArgument(
            'params_file',
            default_value=str(shared_file('config/gait_segmentation.yaml')),
            description='parameters of all nodes',
        ),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', description='take the time from /clock'
        ),
        DeclareLaunchArgument(
            'log_level', default_value='info', description='debug, info, warn, error or fatal'
        ),
    ]
    # Large images need a larger shared memory segment than Fast DDS makes by default.
    environment = dict(os.environ)
    use_shared_memory(environment)
    variables = environment.items() - os.environ.items()
    nodes = [
        _node('gait_tracker', 'split', debug='gait_tracker/debug_image'),
        _node('gait_matcher', 'split', debug='gait_matcher/debug_image'),
        _node('gait_segmenter', 'split'),
        _node('gait_pipeline', 'single'),
    ]
    settings = [SetEnvironmentVariable(name, value) for name, value in sorted(variables)]
    return LaunchDescription([*arguments, *settings, *nodes])


def _node(executable, style, debug='debug_image'):
    image = LaunchConfiguration('image')
    return Node(
        package=PACKAGE,
        executable=executable,
        name=executable,
        namespace=LaunchConfiguration('namespace'),
        condition=IfCondition(EqualsSubstitution(LaunchConfiguration('style'), style)),
        parameters=[
            LaunchConfiguration('params_file'),
            {'use_sim_time': ParameterValue(LaunchConfiguration('use_sim_time'), value_type=bool)},
        ],
        remappings=[
            ('image', image),
            ('image/compressed', [image, '/compressed']),
            ('debug_image', debug),
        ],
        arguments=['--ros-args', '--log-level', LaunchConfiguration('log_level')],
        output='screen',
    )
