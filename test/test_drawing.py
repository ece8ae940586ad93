# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.drawing import (
    REFINED_COLOUR,
    TRACKED_COLOUR,
    draw_box,
    draw_label,
    draw_match,
    draw_outline,
    draw_person,
    draw_phase_dial,
    view_word,
)
from gait_segmentation.errors import InputError
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


def test_an_empty_mask_draws_nothing_and_a_wrong_one_is_refused():
    image = grey(20, 20)
    draw_outline(image, np.zeros((20, 20), np.uint8), GREEN)
    assert not changed(image).any()
    with pytest.raises(InputError, match=r'\(20, 20\), got \(10, 20\)'):
        draw_outline(image, np.zeros((10, 20), np.uint8), GREEN)


def test_a_turned_box_leans_to_the_right():
    image = grey(60, 60)
    draw_box(image, Box(25, 10, 10, 40), GREEN, math.radians(30))
    columns = np.flatnonzero(changed(image)[15])
    assert columns.mean() > 34
    assert np.flatnonzero(changed(image)[45]).mean() < 26


def test_a_match_is_a_red_box_a_green_one_and_an_outline():
    image = grey(60, 80)
    template = square(30, 40, 10, 15, 8)
    draw_match(
        image, tracked=Box(5.5, 5.5, 60, 50), refined=Box(20.5, 10.5, 40, 40), template=template
    )
    for column, colour in ((5, TRACKED_COLOUR), (20, REFINED_COLOUR)):
        assert np.abs(image[30, column].astype(int) - colour).max() < 20
    assert image[27:29, 29:32].min(axis=2).max() > 200
    bare = grey(60, 80)
    draw_match(bare)
    assert not changed(bare).any()


def test_labels_stay_inside_or_are_cut_off():
    for position in ((5, 5), (-50, -50), (1000, 1000)):
        image = grey(40, 120)
        draw_label(image, '0042', position)
        assert changed(image).sum() > 100
        assert image.max() > 200
    image = grey(6, 10)
    draw_label(image, 'very long', (0, 0))
    assert changed(image).any()


def test_the_hand_of_the_dial_runs_clockwise_from_the_top():
    def side(phase):
        image = np.zeros((41, 41, 3), np.uint8)
        draw_phase_dial(image, (20.5, 20.5), 16, phase, GREEN)
        hand = np.argwhere(image[10:31, 10:31, 1] > 200) - 10
        return hand.mean(axis=0)

    assert side(0.25)[1] > 3
    assert side(0.75)[1] < -3
    assert side(0.5)[0] > 3
    assert side(1.25)[1] > 3


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


def test_views_have_words():
    assert view_word(0) == 'to the right'
    assert view_word(math.pi / 2) == 'away'
    assert view_word(math.pi) == view_word(-math.pi) == 'to the left'
    assert view_word(-math.pi / 2 + 0.1) == 'closer'


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
    assert not any(
        is_red(pixel) for pixel in segmentation_picture(IMAGE, masks, [match, NOBODY])[60]
    )


def test_silhouettes_are_drawn_of_those_who_are_matched() -> None:
    mask = SegmentationResult(5, 1, LARGE, '')
    masks = PeopleMasks((mask, mask), LARGE, LARGE)
    assert (segmentation_picture(IMAGE, masks, [NOBODY, NOBODY]) == IMAGE).all()
    assert (segmentation_picture(IMAGE, masks, [SOMEBODY, NOBODY]) != IMAGE).any()
