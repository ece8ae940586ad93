# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a node as a process."""

from __future__ import annotations

import argparse
import faulthandler
import gc
import inspect
import signal
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import cv2
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import get_logger
from rclpy.utilities import remove_ros_args

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.ros.config import CameraConfig
from gait_segmentation.ros.ending import Ending, leave
from gait_segmentation.ros.executor import MessageExecutor
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.participant import take_part

__all__ = ['run_node', 'silence_opencv']

_EPILOG = """\
exit code: 0, also after Ctrl-C; 1 if the node cannot be started, or if it
hung, with the stacks of its threads; 2 if the command line is wrong

examples (after colcon build with "ros2 run gait_segmentation" in front)
  %(prog)s --ros-args -r {remap}
  %(prog)s --ros-args --params-file gait_segmentation.yaml -p max_people:=4

Topics are in docs/ros.md, parameters in docs/parameters.md; "ros2 param list"
and "ros2 param describe" show those of a running node.
"""


class _NotStartedError(Exception):
    """The node's log says why."""


def run_node(make: Callable[[], GaitNode], arguments: list[str] | None = None) -> int:
    """
    Make a node and spin it until Ctrl-C or a shutdown.

    :param arguments: the command line, with ROS arguments; ``sys.argv`` if None.
    :returns: the exit code: 0, 1 if the node could not be started, 2 if the command line is wrong.
    :raises SystemExit: with the usage, if that is asked for or the command line is wrong.
    """
    given = sys.argv if arguments is None else arguments
    ending = Ending()
    ending.handle_signals()
    # As of "kill -USR1".
    faulthandler.register(signal.SIGUSR1, file=2)
    try:
        return _run(make, given, ending)
    finally:
        # To look for garbage among all that has been imported takes the interpreter longer than
        # everything else that it does at the end.
        gc.freeze()
        gc.enable()


def _run(make: Callable[[], GaitNode], arguments: list[str], ending: Ending) -> int:
    name = Path(arguments[0]).name if arguments else 'node'
    node: GaitNode | None = None
    understood = False
    try:
        _check(make, arguments)
        # To look for garbage again and again would take a tenth of the start.
        gc.disable()
        silence_opencv()
        # Of whoever has asked and is gone: nobody is there to be answered.
        warnings.filterwarnings('ignore', 'failed to send response', RuntimeWarning)
        participant = take_part(arguments)
        ending.closes(participant.close)
        understood = True
        get_logger(name).debug(
            f'{participant.freed} bytes of shared memory of killed processes freed'
        )
        # From here on the DDS may hang, as in what a killed process has left locked.
        ending.beat()
        # First: one that is made when a signal has closed the context leaves a traceback.
        executor = MessageExecutor()
        ending.closes(executor.shutdown)
        node = _made(make)
        participant.has_node()
        ending.closes(node.close)
        ending.closes(node.destroy_node)
        if ending.asked:
            return 0
        executor.add_node(node)
        node.create_timer(1.0, ending.beat, clock=Clock(clock_type=ClockType.STEADY_TIME))
        executor.create_task(_start, node)
        executor.spin()
    except ExternalShutdownException:
        pass
    except _NotStartedError:
        # A signal in the middle of the start closes the context under it.
        return 1 if rclpy.ok() else 0
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
        if node is not None and node.compiling:
            # The interpreter must not end under the compiler, which nobody wants to wait for.
            leave(0)
    return 0


def silence_opencv() -> None:
    """Have OpenCV print nothing of images that it cannot decode: the node says it already."""
    # OpenCV 4 has the one, 5 the other, and some both.
    set_level = getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel
    set_level(0)


async def _start(node: GaitNode) -> None:
    try:
        if not await node.start_beside():
            raise _NotStartedError
    finally:
        # What there is now stays, so it need not be looked at while frames come.
        gc.freeze()
        gc.enable()


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
    sees = isinstance(make, type) and issubclass(make, GaitNode) and make.has(CameraConfig)
    parser = argparse.ArgumentParser(
        usage='%(prog)s [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] [--params-file FILE] ...]',
        description=inspect.getdoc(make),
        epilog=_EPILOG.format(remap='image:=/camera/image_raw' if sees else '__ns:=/robot1'),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.parse_args(remove_ros_args(arguments)[1:])
