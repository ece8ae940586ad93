# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes find what the pipeline finds."""

from __future__ import annotations

import numpy as np
import pytest
from sensor_msgs.msg import Image

from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.nodes.camera_node import CameraNode
from gait_segmentation.pipeline import Pipeline
from gait_segmentation.ros.messages import image_message
from gait_segmentation.streams.fields import stamp_of
from test.nodes.bench import CAMERAS, STYLES, Bench, header
from test.walkers import clip, overlap, small_bank

FRAMES = 8


def found_by_nodes(bench: Bench, style: str) -> list[np.ndarray]:
    frames = clip()[:FRAMES]
    box = frames[0].boxes[0]
    start = {'initial_box': [box.x, box.y, box.width, box.height]}
    for kind in STYLES[style]:
        bench.add(kind, **(start if issubclass(kind, CameraNode) else {}))
    bench.record_outputs()
    camera = bench.publisher(Image, 'image', CAMERAS[style])
    for index, frame in enumerate(frames):
        bench.feed(camera, [image_message(frame.image, header(index))])
        # Until the tracker has learnt from the mask, as in lockstep.
        bench.settle()
    return [read_mono8(message) for message in bench.received['mask']]


@pytest.mark.parametrize('style', STYLES)
def test_masks_agree(bench: Bench, style: str) -> None:
    found = found_by_nodes(bench, style)
    frames = clip()[:FRAMES]
    pipeline = Pipeline(bank=small_bank())
    pipeline.initialize(frames[0].boxes[0])
    for index, (frame, mask) in enumerate(zip(frames, found, strict=True)):
        (result,) = pipeline.update(frame.image, stamp_of(header(index)))
        expected = result.mask
        assert expected.any()
        if style == 'single':
            np.testing.assert_array_equal(mask, expected)
        else:
            # Boxes cross as 32-bit floats.
            assert overlap(mask, expected) > 0.97
