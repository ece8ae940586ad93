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
from contextlib import suppress
from functools import partial
from pathlib import Path

import cv2
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.utilities import remove_ros_args

from gait_segmentation.ending import Ending
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.ros.executor import MessageExecutor
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.participant import REFUSALS, said_by, take_part
from gait_segmentation.streams.config import CameraConfig

_TURN_S = 0.2
"""How soon a node notices a signal while nothing else happens."""

_EPILOG = """\
exit code: 0, also after Ctrl-C; 1 if the node cannot be started, or if it
hung, with the stacks of its threads; 2 if the command line is wrong

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
    ending = Ending(rclpy.try_shutdown)
    ending.handle_signals()
    # As of "kill -USR1".
    faulthandler.register(signal.SIGUSR1, file=2)
    try:
        # To look for garbage again and again would take a tenth of the start.
        gc.disable()
        return _run(make, given, name, ending)
    except (GaitSegmentationError, ParameterException) as error:
        print(f'{name}: error: {error}', file=sys.stderr)
        return 1
    finally:
        ending.close()
        # To look for garbage among all that has been imported takes the interpreter longer than
        # everything else that it does at the end.
        gc.freeze()
        gc.enable()


def _run(make: Callable[[], GaitNode], arguments: list[str], name: str, ending: Ending) -> int:
    silence_opencv()
    # Of whoever has asked and is gone: nobody is there to be answered.
    warnings.filterwarnings('ignore', 'failed to send response', RuntimeWarning)
    try:
        _check(make, arguments)
        participant = take_part(arguments)
    except Exception as error:
        # What rclpy does not understand.
        print(f'{name}: error: {said_by(error)}', file=sys.stderr)
        return 2
    ending.closes(participant.close)
    get_logger(name).debug(f'{participant.freed} bytes of shared memory of killed processes freed')
    # From here on the DDS may hang, as in what a killed process has left locked.
    ending.beat()
    executor = MessageExecutor()
    ending.closes(partial(executor.shutdown, 0))
    try:
        node = make()
    except REFUSALS as error:
        # What ROS refuses, such as for a wrong name or for security.
        raise GaitSegmentationError(said_by(error)) from error
    participant.has_node()
    ending.closes(node.close)
    ending.closes(node.destroy_node)
    node.unhurried = ending.unhurried
    if not node.start():
        # The node's log says why.
        return 1
    # What there is now stays, so it need not be looked at while frames come.
    gc.freeze()
    gc.enable()
    executor.add_node(node)
    node.create_timer(_TURN_S, ending.turn, clock=Clock(clock_type=ClockType.STEADY_TIME))
    with suppress(ExternalShutdownException):
        executor.spin()
    return 0


def silence_opencv() -> None:
    """Have OpenCV print nothing of images that it cannot decode: the node says it already."""
    # OpenCV 4 has the one, 5 the other, and some both.
    set_level = getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel
    set_level(0)


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
