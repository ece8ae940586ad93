# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_detector``: images in, heat maps of people by a network out."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

from sensor_msgs.msg import Image

from gait_segmentation.detector.client import Detector
from gait_segmentation.inputs.encodings import read_image
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import image_message
from gait_segmentation.ros.running import run_node
from gait_segmentation.streams.config import CameraConfig
from gait_segmentation.streams.fields import Parts, stamp_of


class DetectorNode(GaitNode):
    """
    Say where people are by mediapipe's network: heat maps for gait_tracker or gait_pipeline.

    Reads image and publishes heat_map.  Always the newest image is taken, whatever backlog says: a
    slow computer gives fewer maps, not later ones.
    """

    name = 'gait_detector'
    groups = (('', CameraConfig),)
    packages = ('gait_segmentation.detector',)

    def build(self) -> None:
        """Start the network, so that a node that is active can answer, and make the publisher."""
        self.stage = Detector()
        self.stage.start()
        self._heat_map = self.output(Image, 'heat_map')

    def release(self) -> None:
        """End the network's process."""
        self.stage.close()

    def configured(self) -> Sequence[tuple[Any, str]]:
        """Return that there is nothing to configure."""
        return []

    def hand_over(self, stamp_ns: int, frame: Parts) -> None:
        """Have the worker take an image in place of one that waits, which is no loss."""
        now_s = time.monotonic()
        self.statistics.arrived(now_s, stamp_ns)
        self.later(partial(self._work, (now_s, stamp_ns, frame)), 'image')

    def process(self, frame: Parts) -> None:
        """Publish the map of an image."""
        message = frame['image']
        camera = self.parameters.get(CameraConfig)
        image = read_image(message, camera.max_pixels, camera.sample_bits)
        self.enter(stamp_of(message.header))
        self._heat_map.publish(image_message(self.stage.map_of(image), message.header))

    def process_unusable(self, frame: Parts) -> None:
        """Publish nothing: images may go without a map."""

    def drop_tracks(self) -> None:
        """Go on: the network has no tracks."""

    def stand_by(self) -> None:
        """End the network's process; the next image starts it again."""
        self.stage.close()

    def status(self) -> dict[str, str]:
        """Report which network runs."""
        return {**super().status(), 'detector': 'mediapipe'}


main = partial(run_node, DetectorNode)
"""Run the node; see :func:`run_node`."""

if __name__ == '__main__':
    sys.exit(main())
