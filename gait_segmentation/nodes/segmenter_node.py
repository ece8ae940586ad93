# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_segmenter``: images, likelihoods and matched templates in, silhouettes out."""

from __future__ import annotations

import sys
from functools import partial

from gait_segmentation.drawing import segmentation_picture
from gait_segmentation.encodings import claimed_shape, read_image, read_mono8
from gait_segmentation.people import PeopleConfig
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import Outputs, mask_topics, picture_topics
from gait_segmentation.ros.running import run_node
from gait_segmentation.segmentation import PeopleSegmenter, SegmentationConfig
from gait_segmentation.streams.config import CameraConfig, SegmenterNodeConfig
from gait_segmentation.streams.fields import Parts, read_match, slot_topic, stamp_of


class SegmenterNode(GaitNode):
    """
    Cut people out of the images of a camera, with what gait_tracker and gait_matcher found.

    Reads image, person_K/likelihood, person_K/matched_box, person_K/shape_prior and
    person_K/gait; publishes mask (of all people), labels (which is whose) and person_K/mask.
    """

    name = 'gait_segmenter'
    reads = ('likelihood', 'matched_box', 'shape_prior', 'gait')
    packages = ('gait_segmentation.segmentation',)
    groups = (
        ('', CameraConfig),
        ('', PeopleConfig),
        ('', SegmenterNodeConfig),
        ('segmentation', SegmentationConfig),
    )

    def build(self) -> None:
        """Make the stage and the publishers."""
        config = self.parameters.get(SegmentationConfig)
        self.stage = PeopleSegmenter(config, max_people=self.slots)
        self._shape: tuple[int, int] | None = None
        self._results = Outputs(self, mask_topics(self.slots))
        self._debug = Outputs(self, picture_topics())

    def process(self, frame: Parts) -> None:
        """Segment a frame."""
        header = frame['image'].header
        camera = self.parameters.get(CameraConfig)
        image = read_image(frame['image'], camera.max_pixels, camera.sample_bits)
        shape = (image.shape[0], image.shape[1])
        self.enter(stamp_of(header))
        if self._shape not in (None, shape):
            self.warnings.warn('size', 'the image size changed: all tracks are reset')
            self.drop_tracks()
        self._shape = shape
        slots = range(self.slots)
        likelihoods = [read_mono8(frame[slot_topic(slot, 'likelihood')]) for slot in slots]
        matches = [read_match(frame, slot) for slot in slots]
        masks = self.stage.update(image, likelihoods, matches)
        self._results.publish(masks, header)
        self._debug.publish_made(header, segmentation_picture, image, masks, matches)

    def process_unusable(self, frame: Parts) -> None:
        """Publish empty masks."""
        header = frame['image'].header
        shape = claimed_shape(frame['image']) or self._shape or (0, 0)
        self._results.blank(shape, header)
        self._debug.blank((*shape, 3), header)


main = partial(run_node, SegmenterNode)
"""Run the node; see :func:`run_node`."""

if __name__ == '__main__':
    sys.exit(main())
