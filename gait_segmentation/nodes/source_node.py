# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_source``: a film or a folder of images as a live camera."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from itertools import chain, repeat
from pathlib import Path

import numpy as np
import rclpy
from numpy.typing import NDArray
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from gait_segmentation.cli.film import Film
from gait_segmentation.errors import GaitSegmentationError, SequenceError
from gait_segmentation.ros.image import image_message
from gait_segmentation.ros.messages import stamp_of
from gait_segmentation.ros.qos import BETWEEN_NODES

__all__ = ['main', 'parser', 'publish_film']

_FLOW_OUT_S = 10
_POLL_S = 0.02


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog='gait_source',
        description='Publish a film or a folder of images on the topic image, as a camera would: '
        'at its rate, stamped with the time of publishing.',
    )
    add = made.add_argument
    add('input', type=Path, help='film, or folder of images (in the order of their names)')
    add('--rate', type=float, default=0.0, metavar='HZ', help="frames per second (the film's)")
    add('--width', type=int, default=0, metavar='PX', help='scale down to this width')
    add('--start', type=int, default=0, metavar='N', help='first frame, counted from 0')
    add('--count', type=int, metavar='M', help='number of frames (all)')
    add('--loop', action='store_true', help='begin again at the end, until interrupted')
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
        help='begin when N subscribers are connected',
    )
    add('--wait-timeout', type=float, default=60.0, metavar='S', help='and fail after this time')
    add('--stamps', type=Path, metavar='FILE', help='write "frame stamp_ns" of every frame')
    add('--frame-id', default='camera', help='frame_id of the headers (%(default)s)')
    return made


def publish_film(options: argparse.Namespace, node: Node) -> int:
    """
    Publish all frames.

    :returns: how many were published.
    :raises SequenceError: if the input cannot be used or nobody subscribes in time.
    """
    film = Film(options.input, width=options.width, start=options.start, count=options.count)
    if options.rate < 0:
        raise SequenceError(f'--rate must be positive, got {options.rate:g}')
    period = 1 / (options.rate or film.fps)
    frames = _frames(film, options.loop, options.preload)
    publisher = node.create_publisher(Image, 'image', BETWEEN_NODES)
    _wait_for(publisher, options.wait_for, options.wait_timeout)
    published = 0
    with open(options.stamps or os.devnull, 'w', encoding='ascii') as stamps:
        due = time.monotonic()
        for image in frames:
            # Copied into the message before the frame is due, stamped when it is.
            message = image_message(image, Header(frame_id=options.frame_id))
            time.sleep(max(due - time.monotonic(), 0.0))
            message.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(message)
            stamps.write(f'{film.start + published} {stamp_of(message.header)}\n')
            stamps.flush()
            published += 1
            # A camera that was held up does not catch up.
            due = max(due + period, time.monotonic())
    publisher.wait_for_all_acked(Duration(seconds=_FLOW_OUT_S))
    return published


def _frames(film: Film, loop: bool, preload: bool) -> Iterator[NDArray[np.uint8]]:
    if preload:
        kept = list(film.frames())
        return chain.from_iterable(repeat(kept)) if loop else iter(kept)
    if loop:
        return chain.from_iterable(film.frames() for _ in repeat(None))
    return film.frames()


def _wait_for(publisher: rclpy.publisher.Publisher, subscribers: int, timeout_s: float) -> None:
    deadline = time.monotonic() + timeout_s
    while publisher.get_subscription_count() < subscribers:
        if time.monotonic() > deadline:
            raise SequenceError(
                f'--wait-for {subscribers}: only {publisher.get_subscription_count()} '
                f'subscribers on {publisher.topic_name} within {timeout_s:g} s'
            )
        time.sleep(_POLL_S)


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    given = sys.argv if arguments is None else ['gait_source', *arguments]
    options = parser().parse_args(remove_ros_args(given)[1:])
    try:
        rclpy.init(args=given)
        node = Node('gait_source')
        published = publish_film(options, node)
        node.get_logger().info(f'{published} frames published')
        node.destroy_node()
    except GaitSegmentationError as error:
        print(f'gait_source: error: {error}', file=sys.stderr)
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
