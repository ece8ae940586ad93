# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a node as a process."""

from __future__ import annotations

import argparse
import faulthandler
import gc
import inspect
import os
import signal
import sys
import tempfile
from contextlib import suppress

import cv2
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.streams.config import CameraConfig

_LONGEST_S = 4.0
"""Time that closing may take: a call into the DDS may block for ever."""

_EPILOG = """\
exit code: 0, also after Ctrl-C; 1 if the node cannot be started; 2 if the
command line is wrong

examples (after colcon build with "ros2 run gait_segmentation" in front)
  %(prog)s --ros-args -r {remap}
  %(prog)s --ros-args --params-file gait_segmentation.yaml -p max_people:=4

Topics are in docs/ros.md, parameters in docs/parameters.md; "ros2 param list"
and "ros2 param describe" show those of a running node.
"""


def run_node(make: type[GaitNode], arguments: list[str] | None = None) -> int:
    """
    Make a node and spin it until Ctrl-C or a shutdown.

    :param arguments: the command line, with ROS arguments; ``sys.argv`` if None.
    :returns: the exit code: 0, 1 if the node could not be started, 2 if the command line is wrong.
    :raises SystemExit: with the usage, if that is asked for or the command line is wrong.
    """
    given = sys.argv if arguments is None else arguments
    _check(make, given)
    silence_opencv()
    # As of "kill -USR1".
    faulthandler.register(signal.SIGUSR1, file=2)
    # As in services: rcl would find no place for its logs, or make a folder that is named ~.
    if not os.environ.get('HOME'):
        os.environ.setdefault('ROS_LOG_DIR', tempfile.gettempdir())
    node: GaitNode | None = None
    code = 2
    try:
        rclpy.init(args=given)
        code = 1
        node = make()
        if not node.start():
            # The node's log says why.
            return code
        # What there is now stays, so it need not be checked while frames come.
        gc.freeze()
        _spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception as error:
        # Otherwise a signal has shut the context down under whatever was being done.
        if rclpy.ok() or code == 2:
            if node is not None:
                raise
            # rclpy puts the name below, and points to a place in it.
            reason = str(error).partition('\n')[0].rstrip(':')
            print(f'{make.name}: error: {reason}', file=sys.stderr)
            return code
    finally:
        faulthandler.dump_traceback_later(_LONGEST_S, exit=True, file=2)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
        faulthandler.cancel_dump_traceback_later()
    return 0


def _spin(node: GaitNode) -> None:
    """Call back until the end; log what rclpy raises of a request, raise what the worker did."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while node.context.ok():
        try:
            executor.spin()
        except ExternalShutdownException:
            return
        except Exception as error:
            if node.failure is not None:
                raise
            node.warnings.warn('refused', f'refused: {type(error).__name__}: {error}')


def silence_opencv() -> None:
    """Have OpenCV print nothing of images that it cannot decode: the node says it already."""
    # OpenCV 4 has the one, 5 the other, and some both.
    set_level = getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel
    set_level(0)


def _check(make: type[GaitNode], arguments: list[str]) -> None:
    """Show the usage if it is asked for, or if there is anything but ROS arguments."""
    remap = 'image:=/camera/image_raw' if make.has(CameraConfig) else '__ns:=/robot1'
    parser = argparse.ArgumentParser(
        prog=make.name,
        usage='%(prog)s [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] [--params-file FILE] ...]',
        description=inspect.getdoc(make),
        epilog=_EPILOG.format(remap=remap),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    # Of wrong ROS arguments rclpy.init tells.
    with suppress(Exception):
        parser.parse_args(remove_ros_args(arguments)[1:])
