# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Start gait_pipeline, and mediapipe_map with the Python of its own environment beside it."""

from pathlib import Path

from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return both nodes on one camera topic."""
    image = LaunchConfiguration('image')
    script = str(Path(__file__).with_name('mediapipe_map.py'))
    return LaunchDescription(
        [
            DeclareLaunchArgument('image', default_value='image', description='camera topic'),
            DeclareLaunchArgument(
                'python',
                default_value=str(Path(__file__).with_name('.venv') / 'bin/python'),
                description='Python of the environment that has mediapipe',
            ),
            Node(
                package='gait_segmentation',
                executable='gait_pipeline',
                remappings=[('image', image)],
            ),
            ExecuteProcess(
                cmd=[
                    LaunchConfiguration('python'),
                    script,
                    '--ros-args',
                    '-r',
                    ['image:=', image],
                ],
                output='screen',
            ),
        ]
    )
