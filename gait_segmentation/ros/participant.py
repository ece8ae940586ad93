# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A process's part in the graph of ROS, which it takes as early as it can.

Fast DDS looks at each process that it discovers for up to seconds if another one was killed, and
nothing can be published meanwhile.  That need not take longer than the imports of a node do, if
the process is there before them: so this imports little.
"""

from __future__ import annotations

import faulthandler
import os
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import rclpy
from rclpy.exceptions import NameValidationException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from gait_segmentation.ending import HANGS_S
from gait_segmentation.files.installed import make_writable
from gait_segmentation.ros.shared_memory import DeadPorts, remove_dead_segments

REFUSALS = (rclpy_implementation.RCLError, NameValidationException)
"""What rclpy raises where ROS does not let somebody in, for a name or for security."""


def said_by(error: Exception) -> str:
    """Return what an error of rclpy says, without the name it points to a place in."""
    return str(error).partition('\n')[0].rstrip(':')


def log_where_possible() -> None:
    """
    Have ROS log to a temporary folder if it cannot write where it would, and say so.

    As in containers and services: there is no HOME, or nobody may write there.  The order of the
    variables is that of rcl_logging.
    """
    home = os.environ.get('HOME', '')
    other = os.environ.get('ROS_HOME', '')
    given = os.environ.get('ROS_LOG_DIR') or (f'{other}/log' if other else '~/.ros/log')
    try:
        if given.startswith('~') and not home:
            raise FileNotFoundError(2, 'there is no HOME', given)
        folder = Path(given.replace('~', home, 1) if given.startswith('~') else given)
        make_writable(folder)
    except OSError as error:
        os.environ['ROS_LOG_DIR'] = tempfile.mkdtemp(prefix='ros_log_')
        print(
            f'logs cannot be written to {given} ({error.strerror}): they are in '
            f'{os.environ["ROS_LOG_DIR"]}',
            file=sys.stderr,
        )


class Participant:
    """The default context, kept away from what killed processes have left in shared memory."""

    def __init__(self, arguments: Sequence[str] | None) -> None:
        """
        Initialise the context; rclpy handles no signals.

        :param arguments: the command line, with ROS arguments.
        :raises RuntimeError: and others of rclpy, if it does not understand them.
        """
        log_where_possible()
        self.freed = remove_dead_segments()
        """Bytes of shared memory of the dead that were freed."""

        self._herald: Node | None = None
        self._ports = DeadPorts()
        try:
            rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        except BaseException:
            self._ports.close()
            raise
        self._ports.start()

    def appear(self) -> None:
        """Be discovered, and discover others, before there is a node: by a hidden one."""
        quiet = {'enable_rosout': False, 'start_parameter_services': False}
        self._herald = Node(f'_gait_{os.getpid()}', use_global_arguments=False, **quiet)

    def has_node(self) -> None:
        """Have the hidden node go, for there is another."""
        if self._herald is not None:
            self._herald.destroy_node()
            self._herald = None

    def close(self) -> None:
        """Let go of everything but the context."""
        self.has_node()
        self._ports.close()


_early: list[Participant] = []


def take_part_early() -> None:
    """Take part with the process's command line, unless that fails: :func:`take_part` says why."""
    # Before anything else can watch over the process.
    faulthandler.dump_traceback_later(HANGS_S, exit=True)
    with suppress(Exception):
        participant = Participant(None)
        _early.append(participant)
        participant.appear()
    faulthandler.cancel_dump_traceback_later()


def take_part(arguments: Sequence[str] | None) -> Participant:
    """
    Return the process's part in the graph, taken now if it was not before.

    :param arguments: the command line, with ROS arguments.
    :raises RuntimeError: and others of rclpy, if it does not understand them.
    """
    return _early.pop() if _early else Participant(arguments)
