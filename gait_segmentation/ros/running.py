# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a node as a process."""

from __future__ import annotations

import argparse
import gc
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import remove_ros_args

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.ros.config import CameraConfig
from gait_segmentation.ros.ending import Ending
from gait_segmentation.ros.executor import MessageExecutor
from gait_segmentation.ros.memory import keep_freed_memory

if TYPE_CHECKING:
    from gait_segmentation.ros.lifecycle import GaitNode

__all__ = ['run_node', 'silence_opencv']

_EPILOG = """\
exit code: 0, also after Ctrl-C; 1 if the node cannot be started; 2 if the
command line is wrong

examples (after colcon build with "ros2 run gait_segmentation" in front)
  %(prog)s --ros-args -r {remap}
  %(prog)s --ros-args --params-file gait_segmentation.yaml -p max_people:=4

Topics are in docs/ros.md, parameters in docs/parameters.md; "ros2 param list"
and "ros2 param describe" show those of a running node.
"""


def run_node(make: Callable[[], GaitNode], arguments: list[str] | None = None) -> int:
    """
    Make a node and spin it until Ctrl-C or a shutdown.

    :param arguments: the command line, with ROS arguments; ``sys.argv`` if None.
    :returns: the exit code: 0, 1 if the node could not be started, 2 if the command line is wrong.
    :raises SystemExit: with the usage, if that is asked for or the command line is wrong.
    """
    given = sys.argv if arguments is None else arguments
    name = Path(given[0]).name if given else 'node'
    ending = Ending()
    understood = False
    try:
        _check(make, given)
        ending.handle_signals()
        keep_freed_memory()
        silence_opencv()
        rclpy.init(args=arguments)
        understood = True
        # First: one that is made when a signal has closed the context leaves a traceback.
        executor = MessageExecutor()
        ending.closes(executor.shutdown)
        node = _made(make)
        ending.closes(node.close)
        ending.closes(node.destroy_node)
        # To compile the kernels may take a minute, which nobody wants to wait for.
        ending.at_once = True
        if ending.asked:
            return 0
        started = node.start()
        ending.at_once = False
        if not started:
            # A signal in the middle of the start closes the context under it.
            return 1 if rclpy.ok() else 0
        executor.add_node(node)
        executor.spin()
    except ExternalShutdownException:
        pass
    except (GaitSegmentationError, ParameterException) as error:
        print(f'{name}: error: {error}', file=sys.stderr)
        return 1
    except Exception as error:
        if not understood:
            print(f'{name}: error: {error}', file=sys.stderr)
            return 2
        # Else whatever rclpy says of a context that a signal has closed under it.
        if rclpy.ok():
            raise
    finally:
        ending.close()
        # To look for garbage among all that has been imported takes the interpreter longer than
        # everything else that it does at the end.
        gc.freeze()
    return 0


def silence_opencv() -> None:
    """Have OpenCV print nothing of images that it cannot decode: the node says it already."""
    # OpenCV 4 has the one, 5 the other, and some both.
    set_level = getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel
    set_level(0)


def _made(make: Callable[[], GaitNode]) -> GaitNode:
    """
    Make the node.

    :raises GaitSegmentationError: if ROS refuses it, such as for a wrong name or for security.
    """
    try:
        return make()
    except rclpy_implementation.RCLError as error:
        if not rclpy.ok():
            raise
        raise GaitSegmentationError(str(error)) from error


def _check(make: Callable[[], GaitNode], arguments: list[str]) -> None:
    """Show the usage if it is asked for, or if there is anything but ROS arguments."""
    sees = any(kind is CameraConfig for _, kind in getattr(make, 'groups', ()))
    parser = argparse.ArgumentParser(
        usage='%(prog)s [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] [--params-file FILE] ...]',
        description=inspect.getdoc(make),
        epilog=_EPILOG.format(remap='image:=/camera/image_raw' if sees else '__ns:=/robot1'),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.parse_args(remove_ros_args(arguments)[1:])
