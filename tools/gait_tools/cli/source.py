# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_source``: a film, a folder of images or a bag as a live camera."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, repeat
from pathlib import Path

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.utilities import remove_ros_args
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from gait_segmentation.cli.tool import (
    POLL_S,
    READING,
    add_reading_options,
    check_ranges,
    command_parser,
    run_tool,
)
from gait_segmentation.errors import ConfigError, GaitSegmentationError, SequenceError
from gait_segmentation.files.output_files import keep_apart, named
from gait_segmentation.inputs import DamagedError, Frame, ImageSource, check_rate, open_input
from gait_segmentation.ros.endpoints import BETWEEN_NODES, said_by
from gait_segmentation.ros.messages import image_message
from gait_segmentation.streams.fields import stamp_of

_FLOW_OUT_S = 10
_LONGEST_GAP_S = 5.0
"""Pauses of a recording that are kept; longer ones are taken for a new recording."""

_DAY_S = 86400.0
_RANGES = {'wait_for': (0, 1000), 'wait_timeout': (0.0, _DAY_S), 'delay': (0.0, _DAY_S)}


_DESCRIPTION = """\
Publish the images of a film, a folder or a bag (rosbag2 or ROS 1) on the topic
image, as a camera would: at their rate, stamped with the time of publishing.
"""

_EPILOG = """\
exit code: 0, also after Ctrl-C; 1 if the input breaks off where it is damaged;
2 if it cannot be used, or not enough subscribers came in time

examples
  gait_source walk.mp4 --width 960 --wait-for 2
  gait_source frames/ --rate 15 --start 40 --count 100 --loop
  gait_source walk_bag --topic /camera/image_raw --keep-stamps --clock
  gait_source walk.mp4 --ros-args -r image:=/camera/image_raw
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_source', _DESCRIPTION, _EPILOG)
    add = made.add_argument
    add(
        'input',
        type=Path,
        help='film, folder of images (in the order of the numbers in their names), or bag',
    )
    add_reading_options(made, 'films: their own; bags: the intervals of the stamps')
    add('--loop', action='store_true', help='begin again at the end, until interrupted')
    add(
        '--keep-stamps',
        action='store_true',
        help='keep the stamps (and frame_id) of the input instead of the time of publishing',
    )
    add(
        '--clock',
        action='store_true',
        help='publish every stamp on /clock, just before its image, for nodes with use_sim_time',
    )
    add(
        '--preload',
        action='store_true',
        help='decode all frames beforehand, so that decoding does not compete with the nodes',
    )
    add(
        '--wait-for',
        type=int,
        default=0,
        metavar='N',
        help='begin when N subscribers of any nodes that can take the images (type, QoS) are '
        'connected',
    )
    add(
        '--wait-timeout',
        type=float,
        default=60.0,
        metavar='S',
        help='how long --wait-for waits before it fails (%(default)s)',
    )
    add(
        '--delay',
        type=float,
        default=0.0,
        metavar='S',
        help='pause before the first frame, so that nodes discover each other',
    )
    add('--stamps', type=Path, metavar='FILE', help='write "frame stamp_ns" of every frame')
    add('--frame-id', default='camera', help='frame_id of the headers (%(default)s)')
    return made


@dataclass
class Pace:
    """
    Says when frames are due, in seconds of a steady clock.

    A camera that was held up does not catch up.
    """

    period_s: float
    by_stamp: bool
    _due_s: float | None = None
    _stamp_ns: int = 0

    def due_s(self, stamp_ns: int, now_s: float) -> float:
        """Return when the next frame is due, whose stamp in the input is given."""
        step_s = self.period_s
        if self.by_stamp:
            gap_s = (stamp_ns - self._stamp_ns) / 1e9
            step_s = gap_s if 0 < gap_s < _LONGEST_GAP_S else self.period_s
        self._stamp_ns = stamp_ns
        self._due_s = now_s if self._due_s is None else max(self._due_s + step_s, now_s)
        return self._due_s


def publish_input(options: argparse.Namespace, node: Node) -> int:
    """
    Publish all frames; those that cannot be read are left out with a warning.

    :returns: how many were published.
    :raises SequenceError: if the input cannot be used or nobody subscribes in time.
    :raises DamagedError: where the input breaks off, after all frames before.
    """
    check_ranges(options, _RANGES)
    check_rate(options.rate)
    keep_apart([('--stamps', options.stamps)], [options.input])
    reading = {name: getattr(options, name) for name in READING if name != 'rate'}
    source = open_input(options.input, **reading)
    pace = Pace(1 / (options.rate or source.fps), by_stamp=not options.rate)
    frames = _frames(source, options.loop, options.preload)
    images = node.create_publisher(Image, 'image', BETWEEN_NODES)
    clock = node.create_publisher(Clock, '/clock', BETWEEN_NODES) if options.clock else None
    _wait_for(node, images, options.wait_for, options.wait_timeout)
    time.sleep(options.delay)
    published = 0
    # Not buffered, so that nothing waits to be written when it is closed.
    with open(options.stamps or os.devnull, 'wb', buffering=0) as stamps:
        for frame in frames:
            if frame.image is None:
                node.get_logger().warning(f'frame {frame.number} is left out: {frame.problem}')
                continue
            # Copied into the message before the frame is due, stamped when it is.
            message = image_message(frame.image, Header(frame_id=options.frame_id))
            now_s = time.monotonic()
            time.sleep(max(pace.due_s(frame.stamp_ns, now_s) - now_s, 0.0))
            if options.keep_stamps:
                seconds, nanoseconds = divmod(frame.stamp_ns, 1_000_000_000)
                message.header.stamp.sec, message.header.stamp.nanosec = seconds, nanoseconds
                message.header.frame_id = frame.frame_id
            else:
                message.header.stamp = node.get_clock().now().to_msg()
            if not node.context.ok():
                break
            if clock is not None:
                clock.publish(Clock(clock=message.header.stamp))
            images.publish(message)
            with named(stamps.name):
                stamps.write(f'{frame.number} {stamp_of(message.header)}\n'.encode())
            published += 1
    if node.context.ok():
        for publisher in filter(None, (images, clock)):
            publisher.wait_for_all_acked(Duration(seconds=_FLOW_OUT_S))
    return published


def _frames(source: ImageSource, loop: bool, preload: bool) -> Iterator[Frame]:
    kept = list(source.frames()) if preload else None
    passes = repeat(None) if loop else [None]
    return chain.from_iterable(source.frames() if kept is None else kept for _ in passes)


def _wait_for(node: Node, publisher: Publisher, subscribers: int, timeout_s: float) -> None:
    deadline = time.monotonic() + timeout_s
    while (connected := publisher.get_subscription_count()) < subscribers:
        if time.monotonic() > deadline:
            name = publisher.topic_name
            others = node.count_subscribers(name) - connected
            raise SequenceError(
                f'--wait-for {subscribers}: only {connected} on {name} within {timeout_s:g} s'
                + (f', and {others} that want another type or QoS' if others > 0 else '')
            )
        time.sleep(POLL_S)


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    given = sys.argv if arguments is None else ['gait_source', *arguments]
    return run_tool('gait_source', lambda: _run(given))


def _run(given: list[str]) -> int:
    node: Node | None = None
    try:
        options = parser().parse_args(remove_ros_args(given)[1:])
        rclpy.init(args=given)
        node = Node('gait_source')
        published = publish_input(options, node)
        node.get_logger().info(f'{published} frames published')
    except (KeyboardInterrupt, ExternalShutdownException):
        # Nothing of a camera that is switched off is worth waiting for.
        pass
    except DamagedError as error:
        print(f'gait_source: warning: {error}', file=sys.stderr)
        return 1
    except (GaitSegmentationError, OSError):
        raise
    except Exception as error:
        # What rclpy does not understand or refuses, unless a signal has shut it down meanwhile.
        if node is None or rclpy.ok():
            raise ConfigError(said_by(error)) from error
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
