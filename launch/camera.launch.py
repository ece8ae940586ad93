# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Start a camera, with whichever driver is installed, and the nodes on its images."""

from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import (
    DeclareLaunchArgument,
    IncludeLaunchDescription,
    OpaqueFunction,
    SetLaunchConfiguration,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

NODES = Path(__file__).with_name('gait_segmentation.launch.py')
FRAME = 'camera_optical_frame'

# Executable, parameters, the one that names the device, and the topics under /camera.
DRIVERS = {
    'realsense2_camera': (
        'realsense2_camera_node',
        {'align_depth.enable': True, 'enable_sync': True},
        'serial_no',
        {
            'image': '/camera/camera/color/image_raw',
            'depth': '/camera/camera/aligned_depth_to_color/image_raw',
            'rviz_frame': 'camera_color_optical_frame',
        },
    ),
    'v4l2_camera': (
        'v4l2_camera_node',
        {'camera_frame_id': FRAME},
        'video_device',
        {'image': '/camera/image_raw'},
    ),
    'usb_cam': (
        'usb_cam_node_exe',
        {'frame_id': FRAME},
        'video_device',
        {'image': '/camera/image_raw'},
    ),
}

ARGUMENTS = [
    DeclareLaunchArgument(
        'driver',
        default_value='auto',
        choices=['auto', *DRIVERS],
        description='package of the camera driver; auto = the first of these that is installed',
    ),
    DeclareLaunchArgument(
        'device',
        default_value='',
        description='such as /dev/video2, or the serial number of a RealSense; empty = the first',
    ),
]


def generate_launch_description():
    """Return what ``ros2 launch`` is to do."""
    nodes = IncludeLaunchDescription(PythonLaunchDescriptionSource(str(NODES)))
    # The nodes' file sets the shared memory profile, for the camera that comes after it as well.
    steps = [OpaqueFunction(function=_topics), nodes, OpaqueFunction(function=_camera)]
    return LaunchDescription([*ARGUMENTS, *steps])


def _installed(package):
    try:
        return bool(get_package_prefix(package))
    except PackageNotFoundError:
        return False


def _driver(context):
    wanted = LaunchConfiguration('driver').perform(context)
    names = list(DRIVERS) if wanted == 'auto' else [wanted]
    for name in names:
        if _installed(name):
            return name
    packages = ' or '.join(f'ros-$ROS_DISTRO-{name.replace("_", "-")}' for name in names)
    raise ValueError(
        f'there is no camera driver: none of {", ".join(names)} is installed; sudo apt install '
        f'{packages}'
    )


def _topics(context):
    *_, topics = DRIVERS[_driver(context)]
    given = context.launch_configurations
    return [SetLaunchConfiguration(name, topics[name]) for name in topics if name not in given]


def _camera(context):
    driver = _driver(context)
    executable, parameters, device_name, _ = DRIVERS[driver]
    device = LaunchConfiguration('device').perform(context)
    if device:
        # A serial number is a text, though it looks like a number.
        parameters = {**parameters, device_name: ParameterValue(device, value_type=str)}
    camera = Node(
        package=driver,
        executable=executable,
        name='camera',
        namespace='camera',
        parameters=[parameters],
        output='screen',
    )
    return [camera]
