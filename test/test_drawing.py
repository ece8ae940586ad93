# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import replace

import numpy as np

from gait_segmentation.drawing import (
    draw_outline,
    draw_person,
    view_word,
)
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.pictures import (
    matching_picture,
    segmentation_picture,
    tracking_picture,
)
from gait_segmentation.results import EMPTY, LOST, MatchResult, SegmentationResult, TrackResult
from gait_segmentation.segmentation import PeopleMasks

GREEN = (0, 255, 0)


def grey(height, width):
    return np.full((height, width, 3), 90, np.uint8)


def is_green(pixel):
    return pixel[1] > 200 and pixel[0] < 100 and pixel[2] < 100


def square(height, width, top, left, size):
    mask = np.zeros((height, width), np.uint8)
    mask[top : top + size, left : left + size] = 255
    return mask


def changed(image, before=90):
    return (image != before).any(axis=2)


def test_the_outline_lies_on_the_rim_of_the_mask_and_of_holes():
    image = grey(30, 40)
    draw_outline(image, square(30, 40, 10, 12, 8), GREEN)
    assert is_green(image[10, 15])
    assert not changed(image)[12:16, 14:18].any()
    assert not changed(image)[:9].any()
    assert not changed(image)[:, 22:].any()
    mask = square(40, 40, 5, 5, 30)
    mask[15:25, 15:25] = 0
    image = grey(40, 40)
    draw_outline(image, mask, GREEN)
    assert changed(image)[14:16, 20].any()


def test_a_person_is_drawn():
    image = grey(60, 80)
    mask = square(60, 80, 20, 30, 20)
    draw_person(image, mask=mask, box=Box(30, 20, 20, 20), track_id=1, phase=0.1, azimuth=math.pi)
    assert changed(image)[30, 40]
    border, beyond = grey(30, 30), Box(20, -5, 30, 60)
    draw_person(border, mask=square(30, 30, 0, 20, 30), box=beyond, track_id=3, phase=0.9)
    assert changed(border).any()
    bare = grey(60, 80)
    draw_person(bare, mask=np.zeros((60, 80), np.uint8), box=None, track_id=0)
    assert not changed(bare).any()


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


def is_red(pixel: np.ndarray) -> bool:
    return bool(pixel[2] > 200 and pixel[0] < 100 and pixel[1] < 100)


def test_both_boxes_are_drawn_where_the_source_has_them() -> None:
    tracks = [
        TrackResult(5, 1, Box(40.5, 20.5, 30, 80), SMALL, 0.9, body=Box(36.5, 16.5, 38, 90)),
        TrackResult(5, 0, None, np.zeros_like(SMALL), 0.0),
    ]
    match = replace(SOMEBODY, box=Box(42.5, 24.5, 26, 70))
    picture = matching_picture([LARGE, LARGE], [match, NOBODY], tracks)
    assert is_red(picture[60, 36])
    assert is_green(picture[60, 42])
    half = matching_picture([SMALL, SMALL], [match, NOBODY], tracks, 160)
    assert is_red(half[30, 18])
    assert is_green(half[30, 21])
    masks = PeopleMasks((SegmentationResult(5, 1, LARGE, ''),) * 2, LARGE, LARGE)
    picture = segmentation_picture(IMAGE, masks, [match, NOBODY], tracks)
    assert is_red(picture[60, 36])
    assert is_green(picture[60, 42])
    assert (segmentation_picture(IMAGE, masks, [NOBODY, NOBODY]) == IMAGE).all()
    assert (segmentation_picture(IMAGE, masks, [SOMEBODY, NOBODY]) != IMAGE).any()


def test_where_somebody_walks_is_said_in_words() -> None:
    said = [view_word(math.radians(degrees)) for degrees in (0, 50, 90, 180, -90)]
    assert said == ['to the right', 'away, right', 'away', 'to the left', 'closer']
