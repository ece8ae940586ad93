# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a node as a process."""

from __future__ import annotations

import argparse
import gc
import inspect
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.signals import uninstall_signal_handlers
from rclpy.utilities import remove_ros_args

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.ros.executor import MessageExecutor
from gait_segmentation.ros.memory import keep_freed_memory

if TYPE_CHECKING:
    from gait_segmentation.ros.lifecycle import GaitNode

__all__ = ['Patience', 'run_node']

_ENDING = (signal.SIGINT, signal.SIGTERM)


def run_node(make: Callable[[], GaitNode], arguments: list[str] | None = None) -> int:
    """
    Make a node and spin it until Ctrl-C or a shutdown.

    :param arguments: the command line, with ROS arguments; ``sys.argv`` if None.
    :returns: the exit code: 0, 1 if the node could not be started, 2 if the command line is wrong.
    :raises SystemExit: with the usage, if that is asked for or the command line is wrong.
    """
    patience = Patience()
    node: GaitNode | None = None
    executor: MessageExecutor | None = None
    understood = False
    try:
        _check(make, sys.argv if arguments is None else arguments)
        # rclpy's own handler closes the context, which ends everything in order; an exception
        # in the middle of whatever runs would not.
        for number in _ENDING:
            signal.signal(number, patience)
        keep_freed_memory()
        rclpy.init(args=arguments)
        understood = True
        # First: one that is made when a signal has closed the context leaves a traceback.
        executor = MessageExecutor()
        node = make()
        # To compile the kernels may take a minute, which nobody wants to wait for.
        patience.short = True
        if patience.pressed:
            return 0
        started = node.start()
        patience.short = False
        if not started:
            # A signal in the middle of the start closes the context under it.
            return 1 if rclpy.ok() else 0
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (GaitSegmentationError, ParameterException) as error:
        print(f'{type(error).__name__}: {error}', file=sys.stderr)
        return 1
    except Exception as error:
        if not understood:
            print(f'{type(error).__name__}: {error}', file=sys.stderr)
            return 2
        # Else whatever rclpy says of a context that a signal has closed under it.
        if rclpy.ok():
            raise
    finally:
        # Nothing that could be interrupted comes before this.
        patience.ended = True
        _ignore_signals()
        if executor is not None:
            executor.shutdown()
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
        # To look for garbage among all that has been imported takes the interpreter longer than
        # everything else that it does at the end.
        gc.freeze()
    return 0


def _ignore_signals() -> None:
    """
    Let no signal interfere with the clean-up.

    rclpy handles signals in a thread that uses the executor's guard condition, so that thread
    must have ended before the executor is shut down.
    """
    uninstall_signal_handlers()
    for number in _ENDING:
        signal.signal(number, signal.SIG_IGN)


class Patience:
    """
    Lets the first signal pass: only who sends another one does not want to wait.

    Several that come at the same moment are one to Python.
    """

    def __init__(self) -> None:
        """Begin before the first."""
        self.pressed = False
        self.short = False
        """Whether the first one breaks off what runs."""

        self.ended = False
        """Whether it is too late to break anything off."""

    def __call__(self, number: int, frame: object) -> None:
        """Handle a signal, as :func:`signal.signal` asks for it."""
        if self.ended:
            return
        if self.short or self.pressed:
            raise KeyboardInterrupt
        self.pressed = True


def _check(make: Callable[[], GaitNode], arguments: list[str]) -> None:
    """Show the usage if it is asked for, or if there is anything but ROS arguments."""
    parser = argparse.ArgumentParser(
        usage='%(prog)s [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] [--params-file FILE] ...]',
        description=inspect.getdoc(make),
        epilog='Parameters and topics are in docs/ros.md; "ros2 param list" and "ros2 param '
        'describe" tell those of a node that runs.',
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.parse_args(remove_ros_args(arguments)[1:])
