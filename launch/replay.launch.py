# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Play a bag, a film or a folder of images through the nodes, at the rate it was recorded."""

import shutil
from pathlib import Path

from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
    RegisterEventHandler,
    TimerAction,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

from launch import LaunchDescription

NODES = Path(__file__).with_name('gait_segmentation.launch.py')
DELAY_S = '1'
"""Time for the nodes to find each other when they have found the images."""

FLOW_OUT_S = 3.0
"""Time for the last frames to pass before everything ends."""

ARGUMENTS = [
    DeclareLaunchArgument('input', description='bag (ROS 2 or ROS 1), film or folder of images'),
    DeclareLaunchArgument(
        'topic', default_value='', description='topic of the images, if a bag has several'
    ),
    DeclareLaunchArgument(
        'rate', default_value='0', description='frames per second; 0 = as recorded'
    ),
    DeclareLaunchArgument(
        'rotate',
        default_value='0',
        choices=['0', '90', '180', '270'],
        description='degrees by which frames are turned clockwise',
    ),
    DeclareLaunchArgument(
        'width', default_value='0', description='scale down to this width; 0 = as recorded'
    ),
    DeclareLaunchArgument(
        'loop', default_value='false', choices=['true', 'false'], description='repeat forever'
    ),
    DeclareLaunchArgument(
        'keep_stamps',
        default_value='true',
        choices=['true', 'false'],
        description='true = the stamps of the input, also on /clock (give use_sim_time:=true to '
        'follow it); false = the time of publishing',
    ),
]


def generate_launch_description():
    """Return what ``ros2 launch`` is to do."""
    nodes = IncludeLaunchDescription(PythonLaunchDescriptionSource(str(NODES)))
    check = OpaqueFunction(function=_check)
    return LaunchDescription([*ARGUMENTS, check, nodes, OpaqueFunction(function=_source)])


def _check(_context):
    if not shutil.which('gait_source'):
        raise RuntimeError('there is no gait_source: pip install ./tools of gait_segmentation')


def _source(context):
    def given(name):
        return LaunchConfiguration(name).perform(context)

    # Both the tracker and the segmenter read the images.
    readers = 1 if given('style') == 'single' else 2
    options = [word for name in ('rate', 'rotate', 'width') for word in (f'--{name}', given(name))]
    options += ['--wait-for', str(readers), '--wait-timeout', '120', '--delay', DELAY_S]
    options += ['--topic', given('topic')] if given('topic') else []
    options += ['--loop'] if given('loop') == 'true' else []
    options += ['--keep-stamps', '--clock'] if given('keep_stamps') == 'true' else []
    remaps = ['-r', f'image:={given("image")}']
    if given('namespace'):
        remaps += ['-r', f'__ns:=/{given("namespace").strip("/")}']
    words = [*options, '--', given('input'), '--ros-args', *remaps]
    source = ExecuteProcess(cmd=['gait_source', *words], output='screen')
    return [source, RegisterEventHandler(OnProcessExit(target_action=source, on_exit=_flow_out))]


def _flow_out(event, _context):
    end = OpaqueFunction(function=_end, args=[event.returncode])
    return [TimerAction(period=FLOW_OUT_S, actions=[end])]


def _end(_context, code):
    if code:
        # launch would end with 0.
        raise RuntimeError(f'gait_source has ended with exit code {code}, and says why above')
    return [EmitEvent(event=Shutdown(reason='the input has ended'))]
