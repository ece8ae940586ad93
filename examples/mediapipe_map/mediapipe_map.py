#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The person mask of mediapipe's pose network as a heat map for gait_tracker or gait_pipeline.

Subscribes to ``image`` (sensor_msgs/Image) and publishes ``heat_map`` (mono8, with the header of
the image it was made of).  Always the newest image is taken, so that a slow computer gives fewer
maps rather than later ones.  mediapipe finds one person.
"""

from __future__ import annotations

import sys
import threading

import mediapipe
import numpy as np
import rclpy
from numpy.typing import NDArray
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

CHANNELS = {'bgr8': (2, 1, 0), 'rgb8': (0, 1, 2), '8UC3': (2, 1, 0)}
"""Where red, green and blue are in a pixel of each encoding that is understood."""


class MapMaker:
    """Turns images into maps."""

    def __init__(self) -> None:
        """Load the network, which comes with the wheel."""
        self._pose = mediapipe.solutions.pose.Pose(enable_segmentation=True)

    def __call__(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return P(person), (h, w) uint8, of an RGB image; zero where nobody is found."""
        mask = self._pose.process(rgb).segmentation_mask
        if mask is None:
            return np.zeros(rgb.shape[:2], np.uint8)
        return np.rint(255 * np.clip(mask, 0, 1)).astype(np.uint8)


def rgb_of(message: Image) -> NDArray[np.uint8]:
    """Return the image of a message, (h, w, 3) uint8 RGB; ValueError if it cannot be read."""
    if message.encoding not in CHANNELS:
        raise ValueError(f'encoding must be one of {", ".join(CHANNELS)}, got {message.encoding}')
    data = np.frombuffer(message.data, np.uint8)
    rows = data[: message.height * message.step].reshape(message.height, message.step)
    image = rows[:, : 3 * message.width].reshape(message.height, message.width, 3)
    return np.ascontiguousarray(image[..., CHANNELS[message.encoding]])


class MediapipeMap(Node):
    """Publishes a map of the newest image, again and again, in a thread of its own."""

    def __init__(self) -> None:
        """Subscribe and begin."""
        super().__init__('mediapipe_map')
        self._publisher = self.create_publisher(Image, 'heat_map', qos_profile_sensor_data)
        self.create_subscription(Image, 'image', self._received, qos_profile_sensor_data)
        self._newest: Image | None = None
        self._changed = threading.Condition()
        threading.Thread(target=self._work, daemon=True).start()

    def _received(self, message: Image) -> None:
        with self._changed:
            self._newest = message
            self._changed.notify()

    def _work(self) -> None:
        make = MapMaker()
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None)
                message, self._newest = self._newest, None
            try:
                heat = make(rgb_of(message))
            except ValueError as error:
                self.get_logger().warning(f'{error}', throttle_duration_sec=5.0)
                continue
            if not rclpy.ok():
                return
            height, width = heat.shape
            self._publisher.publish(
                Image(
                    header=message.header,
                    height=height,
                    width=width,
                    encoding='mono8',
                    step=width,
                    data=heat.tobytes(),
                )
            )


def main() -> int:
    """Run the node until it is interrupted."""
    rclpy.init()
    try:
        rclpy.spin(MediapipeMap())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
