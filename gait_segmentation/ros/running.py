# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a node as a process."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from gait_segmentation.errors import GaitSegmentationError

if TYPE_CHECKING:
    from gait_segmentation.ros.lifecycle import GaitNode

__all__ = ['run_node']


def run_node(make: Callable[[], GaitNode], arguments: list[str] | None = None) -> int:
    """
    Make a node and spin it until Ctrl-C or a shutdown.

    :param arguments: the command line, with ROS arguments; ``sys.argv`` if None.
    :returns: the exit code: 0, or 1 if the node could not be started.
    """
    node: GaitNode | None = None
    executor: SingleThreadedExecutor | None = None
    try:
        rclpy.init(args=arguments)
        node = make()
        if not node.start():
            # A signal in the middle of the start closes the context under it.
            return 1 if rclpy.ok() else 0
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (GaitSegmentationError, ParameterException) as error:
        print(f'{type(error).__name__}: {error}', file=sys.stderr)
        return 1
    except Exception:
        # Whatever rclpy says of a context that a signal has closed under it.
        if rclpy.ok():
            raise
    finally:
        # A second Ctrl-C must not interrupt the clean-up.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if executor is not None:
            executor.shutdown()
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
