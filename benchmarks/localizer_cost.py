#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What locating people costs gait_pipeline, in processor time of the thread that works on frames.

A synthetic walker of 640 x 480 with depth goes through two nodes in turns, of which one has
``localize``; somebody listens to the mask, and to everything that the localization publishes
(also ``people`` where vision_msgs is installed).  Time of the thread instead of
the wall, so that other work on the machine counts little.  Needs ROS 2::

    python benchmarks/localizer_cost.py [--seconds 4]

Prints median and 95th percentile in ms a frame, without and with, and the difference.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from benchmarks.localization import CAMERAS
from benchmarks.synthetic.perspective import PATHS, Shot, Walk, film
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.geometry import Box
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.ros.messages import image_message

WAIT_S = 30.0
SETTLED = 30
"""Frames that are not counted: of the start."""


def header(shot: Shot) -> Header:
    """Return the header of an image."""
    made = Header(frame_id='camera')
    made.stamp.sec, made.stamp.nanosec = divmod(shot.stamp_ns, 1_000_000_000)
    return made


def depth_message(shot: Shot) -> Image:
    """Return the depth image of a frame, in millimetres."""
    millimetres = np.nan_to_num(1000 * shot.depth, posinf=0).clip(0, 65535).astype(np.uint16)
    message = Image(header=header(shot), encoding='16UC1')
    message.height, message.width = millimetres.shape
    message.step = 2 * message.width
    message.data.frombytes(millimetres.tobytes())
    return message


def made(localize: bool, box: Box) -> Any:
    """Return a configured node whose outputs somebody listens to."""
    given = {
        'localize': localize,
        'initial_box': [float(box.x), float(box.y), float(box.width), float(box.height)],
    }
    overrides = [Parameter(name, value=value) for name, value in given.items()]
    # Each in a namespace, so that what is said to one is not heard by the other.
    space = f'localize_{localize}'.lower()
    node = PipelineNode(namespace=space, parameter_overrides=overrides)
    node.trigger_configure()
    return node


def listen(probe: Node, node: Any) -> None:
    """Subscribe to the mask and to what is said of where people are."""
    heard = ('mask', 'pose', 'walk', 'boxes', 'markers', 'people')
    for each in node._outputs:
        name = each.topic_name
        if name.rsplit('/', 1)[-1] in heard and 'person_0/mask' not in name:
            probe.create_subscription(each.msg_type, name, lambda _: None, 10)
            deadline = time.monotonic() + WAIT_S
            while not each.get_subscription_count() and time.monotonic() < deadline:
                time.sleep(0.01)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--seconds', type=float, default=4.0, help='of film (%(default)s)')
    seconds = parser.parse_args().seconds
    camera, pose = CAMERAS['level']
    path = PATHS['across']
    shots = list(film(Walk(path.at, path.speed, seconds), camera, pose))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    rclpy.init()
    probe = Node('probe')
    box = Box.around(shots[0].mask)
    assert box is not None
    nodes = [made(localize, box) for localize in (False, True)]
    k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
    nodes[1].localizing._calibrated(CameraInfo(width=camera.width, height=camera.height, k=k))
    for node in nodes:
        listen(probe, node)
    spent: list[list[float]] = [[], []]
    for number, shot in enumerate(shots):
        message = image_message(shot.image, header(shot))
        nodes[1].localizing._depths.append(depth_message(shot))
        order = (0, 1) if number % 2 else (1, 0)
        for which in order:
            began = time.thread_time()
            nodes[which].process({'image': message})
            spent[which].append(1e3 * (time.thread_time() - began))
    without, with_it = (np.percentile(each[SETTLED:], (50, 95)) for each in spent)
    for name, values in (('without', without), ('with', with_it), ('more', with_it - without)):
        print(f'{name:8s} median {values[0]:6.2f} ms   95 % {values[1]:6.2f} ms')
    for node in (*nodes, probe):
        getattr(node, 'close', lambda: None)()
        node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(run_tool('localizer_cost.py', main))
