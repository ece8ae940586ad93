# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.drawing import (
    draw_outline,
    segmentation_picture,
    track_colour,
    view_word,
)
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
from gait_segmentation.segmentation import PeopleMasks


def is_green(pixel):
    return pixel[1] > 200 and pixel[0] < 100 and pixel[2] < 100


def changed(image, before=90):
    return (image != before).any(axis=2)


IMAGE = np.full((120, 160, 3), 60, np.uint8)
SMALL = np.zeros((60, 80), np.uint8)
SMALL[10:50, 20:35] = 255
LARGE = np.zeros((120, 160), np.uint8)
LARGE[20:100, 40:70] = 255
NOBODY = MatchResult(5, 0, None, None, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, np.zeros_like(SMALL))
SOMEBODY = MatchResult(5, 1, BodyFrame(55, 60, 80), None, 0, 0, 0.0, 1.0, 0.0, 1.0, 1.0, SMALL)


def is_red(pixel: np.ndarray) -> bool:
    return bool(pixel[2] > 200 and pixel[0] < 100 and pixel[1] < 100)


def test_both_boxes_are_drawn_where_the_source_has_them() -> None:
    tracks = [
        TrackResult(5, 1, Box(40.5, 20.5, 30, 80), SMALL, 0.9, body=Box(36.5, 16.5, 38, 90)),
        TrackResult(5, 0, None, np.zeros_like(SMALL), 0.0),
    ]
    match = replace(SOMEBODY, box=Box(42.5, 24.5, 26, 70))
    masks = PeopleMasks((SegmentationResult(5, 1, LARGE, ''),) * 2, LARGE, LARGE)
    picture = segmentation_picture(IMAGE, masks, [match, NOBODY], tracks)
    assert is_red(picture[60, 36])
    assert is_green(picture[60, 42])
    assert (segmentation_picture(IMAGE, masks, [NOBODY, NOBODY]) == IMAGE).all()


def test_an_outline_lies_on_the_border_of_a_mask_and_of_its_hole() -> None:
    picture, mask = IMAGE.copy(), LARGE.copy()
    mask[50:70, 50:60] = 0
    draw_outline(picture, mask, (0, 255, 0))
    drawn = changed(picture, 60)
    assert drawn[20, 40:70].all()
    assert drawn[20:100, 69].all()
    assert drawn[49, 50:60].all()
    drawn[18:102, 38:72] = False
    assert not drawn.any()


def test_a_person_is_tinted_in_the_colour_of_the_track_and_what_is_known_is_written() -> None:
    assert is_green(track_colour(1))
    assert is_red(track_colour(2))
    masks = PeopleMasks((SegmentationResult(5, 1, LARGE, ''),) * 2, LARGE, LARGE)
    plain = segmentation_picture(IMAGE, masks, [SOMEBODY, NOBODY])
    assert plain[60, 55] == pytest.approx(0.75 * 60 + 0.25 * np.array(track_colour(1)), abs=1)
    assert (plain[110:] == 60).all()
    for change in ({'phase': 0.5}, {'azimuth': math.pi / 2}):
        other = segmentation_picture(IMAGE, masks, [replace(SOMEBODY, **change), NOBODY])
        rows, columns = np.nonzero(changed(other, plain))
        # Above the box.
        assert 0 < rows.max() < 20
        assert columns.min() > 40
    # Who stands has neither.
    stands = [
        segmentation_picture(IMAGE, masks, [replace(SOMEBODY, phase_rate=0.3, phase=p), NOBODY])
        for p in (0.0, 0.5)
    ]
    assert changed(stands[0], plain).any()
    assert not changed(*stands).any()


def test_where_somebody_walks_is_said_in_words() -> None:
    said = [view_word(math.radians(degrees)) for degrees in (0, 50, 90, 180, -90)]
    assert said == ['to the right', 'away, right', 'away', 'to the left', 'closer']
