# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import EMPTY, LOST, MatchResult, SegmentationResult, TrackResult
from gait_segmentation.ros.pictures import (
    matching_picture,
    segmentation_picture,
    tracking_picture,
)
from gait_segmentation.segmentation import PeopleMasks

IMAGE = np.full((120, 160, 3), 60, np.uint8)
SMALL = np.zeros((60, 80), np.uint8)
SMALL[10:50, 20:35] = 255
LARGE = np.zeros((120, 160), np.uint8)
LARGE[20:100, 40:70] = 255
NOBODY = MatchResult(5, 0, None, None, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, np.zeros_like(SMALL))
SOMEBODY = MatchResult(5, 1, BodyFrame(55, 60, 80), None, 0, 0, 0.0, 1.0, 0.0, 1.0, 1.0, SMALL)


def test_likelihoods_are_red_and_boxes_are_drawn() -> None:
    tracks = [
        TrackResult(5, 1, Box(40, 20, 30, 80), SMALL, 0.9),
        TrackResult(5, 2, None, np.zeros_like(SMALL), 0.0, state=LOST),
        TrackResult(5, 0, None, np.zeros_like(SMALL), 0.0, state=EMPTY),
    ]
    picture = tracking_picture(IMAGE, tracks)
    assert picture.shape == IMAGE.shape
    assert picture[60, 55].tolist() == [60, 60, 255]
    assert (picture != IMAGE).any(axis=2)[:20].any()
    assert (IMAGE == 60).all()
    assert (tracking_picture(IMAGE, tracks[2:]) == IMAGE).all()


def test_outlines_of_templates_are_drawn_at_the_largest_size() -> None:
    picture = matching_picture([SMALL, LARGE], [SOMEBODY, NOBODY])
    assert picture.shape == (120, 160, 3)
    assert (picture[60, 55] == 255).all()
    assert (picture != picture[:, :, :1]).any()


def test_silhouettes_are_drawn_of_those_who_are_matched() -> None:
    mask = SegmentationResult(5, 1, LARGE, '')
    masks = PeopleMasks((mask, mask), LARGE, LARGE)
    assert (segmentation_picture(IMAGE, masks, [NOBODY, NOBODY]) == IMAGE).all()
    assert (segmentation_picture(IMAGE, masks, [SOMEBODY, NOBODY]) != IMAGE).any()
