# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Start the three nodes, or gait_pipeline in their place, on a camera topic."""

import os
from difflib import get_close_matches
from pathlib import Path

from launch.actions import (
    DeclareLaunchArgument,
    OpaqueFunction,
    SetEnvironmentVariable,
)
from launch.logging import get_logger
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile

from gait_segmentation.files import prepare, shared_file
from launch import LaunchDescription

PACKAGE = 'gait_segmentation'
NODES = {
    'split': ('gait_tracker', 'gait_matcher', 'gait_segmenter'),
    'single': ('gait_pipeline',),
}
TRUTH = ['true', 'false']
INCLUDING = {'driver', 'device'}
"""Arguments of the file that includes this one."""

ARGUMENTS = [
    DeclareLaunchArgument(
        'style',
        default_value='split',
        choices=list(NODES),
        description='split = tracker, matcher and segmenter as processes of their own; '
        'single = gait_pipeline, one process with the least latency',
    ),
    DeclareLaunchArgument(
        'image', default_value='image', description='topic of the camera images'
    ),
    DeclareLaunchArgument(
        'image_transport',
        default_value='raw',
        choices=['raw', 'compressed'],
        description='raw = the topic itself, compressed = the topic with /compressed behind it '
        '(JPEG or PNG)',
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
        'max_people',
        default_value='',
        description='people tracked at a time, 1 to 16; empty = as in the parameter file',
    ),
    DeclareLaunchArgument(
        'initial_box',
        default_value='',
        description='tight box of a person in the first frame, "[x, y, width, height]" in '
        'pixels; empty = as in the parameter file',
    ),
    DeclareLaunchArgument(
        'use_sim_time',
        default_value='false',
        choices=TRUTH,
        description='use the time of /clock',
    ),
    DeclareLaunchArgument(
        'log_level',
        default_value='info',
        choices=['debug', 'info', 'warn', 'error', 'fatal'],
        description='lowest severity that is logged',
    ),
    DeclareLaunchArgument(
        'respawn',
        default_value='false',
        choices=TRUTH,
        description='restart nodes that die',
    ),
    DeclareLaunchArgument(
        'localize',
        default_value='false',
        choices=TRUTH,
        description='also say where people are in metres: gait_localizer',
    ),
    DeclareLaunchArgument(
        'detector',
        default_value='',
        description='network that looks at whole images: people = those of this package; boxes = '
        'of these only that which says where people are; none; FILE.onnx = your own; empty = as '
        'in the parameter file',
    ),
    DeclareLaunchArgument(
        'camera_info',
        default_value='',
        description="topic of the camera's calibration; empty = camera_info beside image",
    ),
    DeclareLaunchArgument(
        'depth', default_value='depth', description='topic of depth images registered to image'
    ),
    DeclareLaunchArgument(
        'rviz',
        default_value='false',
        choices=TRUTH,
        description='start rviz2 with config/gait_segmentation.rviz; for Foxglove import '
        'config/foxglove_layout.json',
    ),
    DeclareLaunchArgument(
        'rviz_frame',
        default_value='camera_optical_frame',
        description='frame_id of the images, in which rviz2 shows people',
    ),
]


def generate_launch_description():
    """Return what ``ros2 launch`` is to do."""
    # Large images need a larger shared memory segment than Fast DDS makes by default.
    environment = dict(os.environ)
    prepare(environment)
    variables = environment.items() - os.environ.items()
    settings = [SetEnvironmentVariable(name, value) for name, value in sorted(variables)]
    return LaunchDescription([*ARGUMENTS, *settings, OpaqueFunction(function=_nodes)])


def _nodes(context):
    given = {each.name: LaunchConfiguration(each.name).perform(context) for each in ARGUMENTS}
    # launch would only warn, and start the nodes with their defaults.
    if not Path(given['params_file']).is_file():
        raise ValueError(f'params_file:={given["params_file"]} is no file')
    # Nor would it mention a misspelt argument. Arguments of a file that includes this one are no
    # mistake.
    known = {*given, *INCLUDING}
    for name in context.launch_configurations.keys() - known:
        if meant := get_close_matches(name, known, n=1, cutoff=0.75):
            get_logger('launch.user').warning(
                f'there is no argument {name}: did you mean {meant[0]}?'
            )
    names = list(NODES[given['style']])
    if given['localize'] == 'true':
        names.append('gait_localizer')
    shown = [_rviz(given)] if given['rviz'] == 'true' else []
    return [*(_node(name, given) for name in names), *shown]


def _rviz(given):
    view = str(shared_file('config/gait_segmentation.rviz'))
    space = given['namespace'].strip('/')
    topics = ('debug_image', 'markers', 'person_0/pose')
    return Node(
        package='rviz2',
        executable='rviz2',
        arguments=['-d', view, '-f', given['rviz_frame']],
        remappings=[(f'/{each}', f'/{space}/{each}') for each in topics if space],
        parameters=[{'use_sim_time': given['use_sim_time'] == 'true'}],
    )


def _numbers(given, name, count):
    try:
        numbers = [float(each) for each in given[name].strip('[] ').replace(',', ' ').split()]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        wanted = 'a number' if count == 1 else f'{count} numbers'
        raise ValueError(f'{name}:={given[name]} must be {wanted}')
    return numbers


def _node(name, given):
    parameters = {
        'use_sim_time': given['use_sim_time'] == 'true',
        'image_transport': given['image_transport'],
    }
    if given['max_people']:
        parameters['max_people'] = int(_numbers(given, 'max_people', 1)[0])
    if given['detector']:
        parameters['detector.network'] = given['detector']
    if given['initial_box']:
        parameters['initial_box'] = _numbers(given, 'initial_box', 4)
    # Given with or without the suffix that image_transport appends.
    image = given['image'].removesuffix('/compressed')
    return Node(
        package=PACKAGE,
        executable=name,
        name=name,
        namespace=given['namespace'],
        parameters=[ParameterFile(given['params_file']), parameters],
        remappings=[
            ('image', image),
            ('camera_info', given['camera_info'] or str(Path(image).with_name('camera_info'))),
            ('depth', given['depth']),
        ],
        arguments=['--ros-args', '--log-level', given['log_level']],
        output='screen',
        respawn=given['respawn'] == 'true',
        respawn_delay=1.0,
    )
