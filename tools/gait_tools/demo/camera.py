# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A film, a folder of images or a bag as a live camera, in a process of its own.

``python -m gait_tools.demo.camera JSON`` calls :func:`publish` with the arguments in JSON.
"""

from __future__ import annotations

import json
import sys
import time
from itertools import chain, repeat
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from gait_segmentation.cli.tool import POLL_S, run_tool
from gait_segmentation.inputs import open_input
from gait_segmentation.ros.messages import image_message
from gait_segmentation.ros.qos import BETWEEN_NODES
from gait_segmentation.streams.fields import stamp_of
from gait_tools.demo.nodes import ros

_DISCOVERY_S = 1.0  # time for the nodes to be done with finding the camera before it starts
_LONGEST_GAP_S = 5.0
"""Pauses of a recording that are kept; longer ones are taken for a new recording."""


def publish(
    film: str, stamps: str, readers: int, *, loop: bool = False, rate: float = 0.0, **reading: Any
) -> None:
    """Publish a film to so many readers, stamped then; numbers and stamps (ns) go to a file."""
    source = open_input(film, **reading)
    period_s = 1 / (rate or source.fps)
    node = Node('camera')
    images = node.create_publisher(Image, 'image', BETWEEN_NODES)
    while images.get_subscription_count() < readers:
        time.sleep(POLL_S)
    time.sleep(_DISCOVERY_S)
    due_s, before_ns = 0.0, 0
    # Not buffered: what a camera that is stopped has shown is known.
    with open(stamps, 'wb', buffering=0) as file:
        passes = repeat(None) if loop else (None,)
        for frame in chain.from_iterable(source.frames() for _ in passes):
            if frame.image is None:
                print(f'frame {frame.number} is left out: {frame.problem}', file=sys.stderr)
                continue
            # Copied into the message before the frame is due, stamped when it is.
            message = image_message(frame.image, Header(frame_id='camera'))
            gap_s = (frame.stamp_ns - before_ns) / 1e9
            step_s = gap_s if not rate and 0 < gap_s < _LONGEST_GAP_S else period_s
            now_s, before_ns = time.monotonic(), frame.stamp_ns
            due_s = max(due_s + step_s, now_s)
            time.sleep(due_s - now_s)
            message.header.stamp = node.get_clock().now().to_msg()
            images.publish(message)
            file.write(f'{frame.number} {stamp_of(message.header)}\n'.encode())
    images.wait_for_all_acked(Duration(seconds=10))


def main() -> None:
    """Publish what the command line says."""
    with ros():
        publish(**json.loads(sys.argv[1]))


if __name__ == '__main__':
    sys.exit(run_tool('camera', main))
