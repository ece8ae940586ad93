# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Results made up for tests of outputs."""

import numpy as np

from gait_segmentation.cli.lockstep import Replayed
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.inputs import InputFrame
from gait_segmentation.pipeline import FrameResult, PersonResult
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult

STEP_NS = 40_000_000
FIRST_NS = 1_234_567_890_123_456_789


def replayed(index: int, people: list[tuple[int, np.ndarray, float]]) -> Replayed:
    """Return a frame in which people (track id, mask, azimuth) are seen."""
    shape = people[0][1].shape
    stamp = FIRST_NS + index * STEP_NS
    small = np.full((shape[0] // 2, shape[1] // 2), index, np.uint8)
    found = []
    mask, labels = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    for slot, (track_id, own, azimuth) in enumerate(people):
        mask |= own
        labels[own > 0] = slot + 1
        box = Box.around(own) if track_id else None
        body = BodyFrame(box.center_x, box.center_y, box.height, 0.05) if box else None
        found.append(
            PersonResult(
                TrackResult(stamp, track_id, box, small, 0.9, 0.05 if box else 0.0),
                MatchResult(
                    stamp, track_id, body, None, 0, 3, 0.25, 0.9, azimuth, 0.8, 0.7, small
                ),
                SegmentationResult(stamp, track_id, own, ''),
            )
        )
    image = np.full((*shape, 3), 20 * (index % 10), np.uint8)
    frame = InputFrame(index, stamp, stamp + 1000, stamp, 'head_camera', shape, image)
    return Replayed(frame, FrameResult(stamp, tuple(found), mask, labels, {}))
