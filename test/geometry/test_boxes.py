# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box, check_matched_box, check_start_box
from test.geometry.strategies import boxes


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ((0, 0, 0, 5), 'width and height must be positive, got 0 x 5'),
        ((0, 0, 5, -1), 'width and height must be positive, got 5 x -1'),
        ((math.nan, 0, 5, 5), 'finite'),
        ((0, math.inf, 5, 5), 'finite'),
    ],
)
def test_box_refuses_what_is_no_box(values: tuple, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Box(*values)


def test_box_around_a_mask_is_tight() -> None:
    mask = np.zeros((10, 20), np.uint8)
    mask[3:7, 5:9] = 255
    assert Box.around(mask) == Box(5, 3, 4, 4)
    assert Box.around(np.zeros((4, 4), np.uint8)) is None


def test_box_clipping_and_slices() -> None:
    assert Box(-5, -5, 10, 10).clipped(100, 100) == Box(0, 0, 5, 5)
    assert Box(200, 0, 10, 10).clipped(100, 100) is None
    rows, columns = Box(2.5, 1.2, 3, 2).slices(100, 100)
    assert (rows, columns) == (slice(1, 4), slice(2, 6))
    rows, columns = Box(200, 300, 3, 2).slices(100, 100)
    assert rows.start == rows.stop
    assert columns.start == columns.stop


@given(boxes, boxes)
def test_iou_is_symmetric_and_bounded(a: Box, b: Box) -> None:
    assert 0 <= a.iou(b) <= 1 + 1e-9
    assert a.iou(b) == pytest.approx(b.iou(a), abs=1e-12)
    assert a.iou(a) == pytest.approx(1)


@given(boxes, boxes)
def test_union_holds_both(a: Box, b: Box) -> None:
    both = a.union(b)
    for box in (a, b):
        assert both.x <= box.x
        assert both.y <= box.y
        assert both.right >= box.right - 1e-6
        assert both.bottom >= box.bottom - 1e-6


@pytest.mark.parametrize(
    'box', [Box(319, 239, 5, 5), Box(-400, -600, 1280, 960), Box(0, 0, 0.01, 0.01)], ids=str
)
def test_boxes_that_touch_the_image_can_be_started_from(box: Box) -> None:
    check_start_box(box, (320, 240))


@pytest.mark.parametrize(
    'box',
    [Box(320, 0, 5, 5), Box(-5, 0, 5, 5), Box(0, 0, 1281, 9), Box(0, 0, 9, 961)],
    ids=str,
)
def test_other_boxes_cannot(box: Box) -> None:
    with pytest.raises(InputError, match=r'the image of 320 x 240 pixels, got x .* x '):
        check_start_box(box, (320, 240))


@pytest.mark.parametrize(
    'box', [Box(0, 0, 0.5, 0.5), Box(-1000, 0, 2560, 2500), Box(-2000, 2000, 9, 9)], ids=str
)
def test_boxes_about_the_image_can_be_matched(box: Box) -> None:
    check_matched_box(box, (320, 240))


@pytest.mark.parametrize(
    'box',
    [
        Box(0, 0, 9, 0.49),
        Box(0, 0, 1e-300, 9),
        Box(-1000, 0, 2561, 9),
        Box(0, -1000, 9, 1e300),
        Box(0, 2700, 9, 9),
        Box(-1e308, 0, 9, 9),
    ],
    ids=str,
)
def test_absurd_boxes_cannot(box: Box) -> None:
    with pytest.raises(InputError, match=r'0\.5 to 2560 pixels large .* of 320 x 240, got x '):
        check_matched_box(box, (320, 240))


def test_padding_is_added_on_all_sides() -> None:
    assert Box(10, 20, 30, 40).padded(1, 2) == Box(9, 18, 32, 44)
    assert Box(10, 20, 30, 40).padded(-1, -2) == Box(11, 22, 28, 36)


@pytest.mark.parametrize(('dx', 'dy'), [(799, 0), (0, 799), (-799, -799)])
def test_boxes_to_match_may_be_as_far_from_the_middle_on_all_sides(dx: float, dy: float) -> None:
    box = Box.from_center(50 + dx, 30 + dy, 10, 20)
    check_matched_box(box, (100, 60))
    with pytest.raises(InputError, match='at most 800 pixels'):
        check_matched_box(
            box.shifted(math.copysign(2, dx) if dx else 0, 2 if dx == 0 else 0), (100, 60)
        )
