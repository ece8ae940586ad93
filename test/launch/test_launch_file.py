# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The launch file; a robot has launch and launch_ros from apt, there are no wheels of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('launch_ros', reason='needs the packages launch and launch_ros')

from ament_index_python import packages as packages_of
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    SetLaunchConfiguration,
)
from launch.launch_description_sources import get_launch_description_from_python_launch_file
from launch_ros.actions import Node
from launch_ros.utilities import evaluate_parameters

import launch

FOLDER = Path(__file__).parents[2] / 'launch'
FILE = FOLDER / 'gait_segmentation.launch.py'
CAMERA = FOLDER / 'camera.launch.py'
SPLIT = ['gait_tracker', 'gait_matcher', 'gait_segmenter']


def started(file: Path = FILE, **arguments: str) -> list[ExecuteProcess]:
    """Return the nodes, and other processes, that would be started."""
    description = get_launch_description_from_python_launch_file(str(file))
    context = launch.LaunchContext()
    context.launch_configurations.update(arguments)
    known = {argument.name for argument in description.get_launch_arguments()}
    assert set(arguments) <= known
    nodes = []
    waiting = list(description.entities)
    while waiting:
        entity = waiting.pop(0)
        if isinstance(entity, ExecuteProcess):
            nodes.append(entity)
        elif isinstance(entity, DeclareLaunchArgument):
            assert entity.description
            entity.execute(context)
        elif isinstance(entity, SetLaunchConfiguration):
            entity.execute(context)
        elif isinstance(entity, launch.actions.IncludeLaunchDescription | OpaqueFunction):
            made = entity.execute(context) or []
            waiting = [each for each in made if isinstance(each, launch.Action | FOUND)] + waiting
        elif isinstance(entity, launch.LaunchDescription):
            waiting = [*entity.entities, *waiting]
    return nodes


FOUND = launch.LaunchDescription


def names(nodes: list[ExecuteProcess]) -> list[str]:
    return [
        node.node_executable if isinstance(node, Node) else plain(node.cmd[0]) for node in nodes
    ]


def test_three_nodes_are_started_by_default() -> None:
    assert names(started()) == SPLIT
    assert names(started(image='/camera/image_raw', namespace='robot')) == SPLIT


def test_a_box_is_numbers() -> None:
    assert names(started(initial_box='[1, 2, 30.5, 40]')) == SPLIT


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('initial_box', '[left, top]', 'must be 4 numbers'),
        ('initial_box', '1, 2, 3', 'must be 4 numbers'),
        ('max_people', 'two', 'must be a number'),
        ('params_file', 'nowhere.yaml', 'is no file'),
    ],
)
def test_arguments_that_cannot_be_used_are_refused(name: str, value: str, reason: str) -> None:
    with pytest.raises(ValueError) as caught:
        started(**{name: value})
    assert f'{name}:={value} {reason}' in str(caught.value)


@pytest.mark.parametrize(
    ('wrong', 'meant'), [('max_poeple', 'max_people'), ('use_simtime', 'use_sim_time')]
)
def test_a_misspelt_argument_is_a_warning_with_the_one_that_is_meant(
    wrong: str, meant: str, monkeypatch
) -> None:
    said: list[str] = []
    logger = launch.logging.get_logger('launch.user')
    monkeypatch.setattr(logger, 'warning', said.append)
    description = get_launch_description_from_python_launch_file(str(FILE))
    context = launch.LaunchContext()
    context.launch_configurations.update({wrong: '2', 'robot': 'r2', 'driver': 'usb_cam'})
    for entity in description.entities:
        entity.execute(context)
    assert said == [f'there is no argument {wrong}: did you mean {meant}?']


@pytest.mark.parametrize('image', ['/camera/image_raw', '/camera/image_raw/compressed'])
def test_a_compressed_topic_may_be_told_in_full(image: str) -> None:
    for node in started(image=image, image_transport='compressed'):
        remaps = {plain(source): plain(target) for source, target in node._Node__remappings}
        assert remaps['image'] == '/camera/image_raw'


def plain(words: tuple) -> str:
    return ''.join(word.text for word in words)


def test_a_network_is_that_of_the_nodes_that_see_images() -> None:
    for style in ('split', 'single'):
        node, *_ = started(detector='people', style=style)
        assert parameters(node)['detector.network'] == 'people'
        assert 'detector.network' not in parameters(started(style=style)[0])


def remaps(node: Node) -> dict[str, str]:
    return {plain(source): plain(target) for source, target in node._Node__remappings}


def parameters(node: Node) -> dict[str, Any]:
    """Return what is given beside the parameter file."""
    given = [each for each in node._Node__parameters if isinstance(each, dict)]
    return evaluate_parameters(launch.LaunchContext(), given)[-1]


def test_people_are_located_if_asked_for() -> None:
    nodes = started(localize='true', image='/cam/image_raw', depth='/cam/depth')
    assert names(nodes) == [*SPLIT, 'gait_localizer']
    about = remaps(nodes[-1])
    assert (about['camera_info'], about['depth']) == ('/cam/camera_info', '/cam/depth')
    nodes = started(localize='true', style='single', camera_info='/info')
    assert names(nodes) == ['gait_pipeline', 'gait_localizer']
    assert remaps(nodes[-1])['camera_info'] == '/info'


def test_rviz_shows_the_topics_of_the_namespace() -> None:
    *_, view = started(rviz='true', namespace='/robot1', rviz_frame='eye')
    assert names([view]) == ['rviz2']
    words = [part.text for word in view.cmd for part in word if hasattr(part, 'text')]
    assert words[words.index('-f') + 1] == 'eye'
    assert Path(words[words.index('-d') + 1]).is_file()
    assert remaps(view)['/markers'] == '/robot1/markers'
    assert remaps(started(rviz='true')[-1]) == {}


def installed(monkeypatch: pytest.MonkeyPatch, *packages: str) -> None:
    def prefix(name: str) -> str:
        if name not in packages:
            raise packages_of.PackageNotFoundError(name)
        return '/opt/ros/jazzy'

    monkeypatch.setattr(packages_of, 'get_package_prefix', prefix)


def test_the_camera_is_started_with_the_driver_that_is_there(monkeypatch) -> None:
    installed(monkeypatch, 'v4l2_camera')
    nodes = started(CAMERA, device='/dev/video2', style='single')
    assert names(nodes) == ['gait_pipeline', 'v4l2_camera_node']
    assert remaps(nodes[0])['image'] == '/camera/image_raw'
    given = parameters(nodes[1])
    assert given['video_device'] == '/dev/video2'
    assert given['camera_frame_id'] == 'camera_optical_frame'
    installed(monkeypatch, 'usb_cam', 'realsense2_camera')
    nodes = started(CAMERA, device='123')
    assert names(nodes) == [*SPLIT, 'realsense2_camera_node']
    assert remaps(nodes[0])['depth'] == '/camera/camera/aligned_depth_to_color/image_raw'
    assert remaps(nodes[0])['camera_info'] == '/camera/camera/color/camera_info'
    assert parameters(nodes[-1])['serial_no'] == '123'
    assert names(started(CAMERA, driver='usb_cam'))[-1] == 'usb_cam_node_exe'


def test_without_a_driver_it_is_said_what_to_install(monkeypatch) -> None:
    installed(monkeypatch)
    with pytest.raises(ValueError, match=r'sudo apt install .*ros-\$ROS_DISTRO-v4l2-camera'):
        started(CAMERA)
    with pytest.raises(ValueError, match='none of usb_cam is installed'):
        started(CAMERA, driver='usb_cam')
