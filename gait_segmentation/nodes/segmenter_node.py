# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_segmenter``: images, likelihoods and matched templates in, silhouettes out."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

from geometry_msgs.msg import PolygonInstanceStamped
from sensor_msgs.msg import CompressedImage, Image, JointState

from gait_segmentation.config import StageConfig
from gait_segmentation.geometry import Box
from gait_segmentation.results import MatchResult
from gait_segmentation.ros.camera import CameraSubscription, claimed_shape, decode
from gait_segmentation.ros.config import CameraConfig, SegmenterNodeConfig
from gait_segmentation.ros.image import read_mono8
from gait_segmentation.ros.join import ExactJoin
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import read_body, read_gait, stamp_of
from gait_segmentation.ros.outputs import (
    SLOT,
    DebugOutput,
    SegmentationOutputs,
    segmentation_picture,
)
from gait_segmentation.ros.running import run_node
from gait_segmentation.segmentation import SegmentationConfig, Segmenter
from gait_segmentation.warm_up import warm_up_segmenter

__all__ = ['SegmenterNode', 'main']

Parts = dict[str, Any]


class SegmenterNode(GaitNode):
    """Runs the segmentation stage."""

    groups = (
        ('', CameraConfig),
        ('', SegmenterNodeConfig),
        ('segmentation', SegmentationConfig),
    )

    def __init__(self, **options: Any) -> None:
        """Make the node, unconfigured."""
        super().__init__('gait_segmenter', **options)
        self._segmenter: Segmenter | None = None

    def build(self) -> None:
        """Make the stage, compile it and make the publishers."""
        config = self.parameters.get(SegmentationConfig)
        warm_up_segmenter(config)
        self._segmenter = Segmenter(config)
        self._shape: tuple[int, int] | None = None
        self._stamp_ns = 0
        self._results = SegmentationOutputs(self)
        self._debug = DebugOutput(self)

    def connect(self) -> None:
        """Subscribe to the camera and to the other nodes' outputs."""
        self._join = ExactJoin(
            ('image', 'likelihood', 'box', 'prior', 'gait'),
            self.parameters.get(SegmenterNodeConfig).keep_images,
        )
        for kind, topic, part in (
            (Image, 'likelihood', 'likelihood'),
            (PolygonInstanceStamped, 'matched_box', 'box'),
            (Image, 'shape_prior', 'prior'),
            (JointState, 'gait', 'gait'),
        ):
            self.input(kind, f'{SLOT}/{topic}', partial(self._part, part))
        camera = CameraSubscription(
            self,
            self.parameters.get(CameraConfig),
            lambda message: self._part('image', message),
        )
        self._inputs.append(camera)

    def release(self) -> None:
        """Let go of the stage."""
        self._segmenter = None

    def apply(self, group: str, config: StageConfig) -> None:
        """Put a changed configuration into force."""
        if self._segmenter is not None and isinstance(config, SegmentationConfig):
            self._segmenter.config = config

    def forget(self) -> None:
        """Forget the person."""
        if self._segmenter is not None:
            self._segmenter.reset()

    def process(self, frame: Parts) -> None:
        """Segment a frame."""
        assert self._segmenter is not None
        header = frame['image'].header
        stamp_ns = stamp_of(header)
        image = decode(frame['image'])
        shape = (image.shape[0], image.shape[1])
        if stamp_ns < self._stamp_ns or self._shape not in (None, shape):
            self.warn('reset', 'the stamp went back or the image size changed: starting anew')
            self._segmenter.reset()
        self._stamp_ns, self._shape = stamp_ns, shape
        match = read_match(frame)
        result = self._segmenter.update(image, read_mono8(frame['likelihood']), match)
        self._results.publish(result, header)
        if self._debug.wanted:
            box = Box.around(result.mask) if match.body is not None else None
            picture = segmentation_picture(image, result.mask, box, match)
            self._debug.publish(picture, header)

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty masks."""
        header = frame['image'].header
        shape = self._blank_shape(frame['image'])
        self._results.blank(shape, header)
        self._debug.blank(shape, header)

    def _blank_shape(self, message: Image | CompressedImage) -> tuple[int, int]:
        return claimed_shape(message) or self._shape or (0, 0)

    def _part(self, part: str, message: Any) -> None:
        stamp_ns = stamp_of(message.header)
        if not self.accept(stamp_ns):
            return
        parts = self._join.add(part, stamp_ns, message)
        if parts is not None:
            self.hand_over(stamp_ns, parts)


def read_match(parts: Parts) -> MatchResult:
    """
    Put the matcher's messages together again.

    What the segmentation does not need (template, placement, similarity) is not sent.

    :raises InputError: if a message cannot be read.
    """
    phase, rate, azimuth = read_gait(parts['gait'])
    return MatchResult(
        stamp_ns=stamp_of(parts['box'].header),
        track_id=int(parts['box'].polygon.id),
        body=read_body(parts['box']),
        placement=None,
        sequence=0,
        phase_index=0,
        phase=phase,
        phase_rate=rate,
        azimuth=azimuth,
        similarity=0.0,
        confidence=0.0,
        shape_prior=read_mono8(parts['prior']),
    )


def main(arguments: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(SegmenterNode, arguments)


if __name__ == '__main__':
    sys.exit(main())
