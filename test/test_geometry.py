# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import (
    BodyFrame,
    Box,
    check_body,
    check_matched_box,
    check_start_box,
    reach,
    template_to_image,
)

numbers = st.floats(-500, 500)
sizes = st.floats(0.5, 500)
boxes = st.builds(Box, numbers, numbers, sizes, sizes)
bodies = st.builds(BodyFrame, numbers, numbers, sizes, st.floats(-1.2, 1.2))


@pytest.mark.parametrize(
    'values', [(0, 0, 0, 5), (0, 0, 5, -1), (math.nan, 0, 5, 5), (0, math.inf, 5, 5)]
)
def test_box_refuses_what_is_no_box(values: tuple) -> None:
    with pytest.raises(InputError):
        Box(*values)


def test_box_around_a_mask_is_tight() -> None:
    mask = np.zeros((10, 20), np.uint8)
    mask[3:7, 5:9] = 255
    assert Box.around(mask) == Box(5, 3, 4, 4)
    assert Box.around(np.zeros((4, 4), np.uint8)) is None


def test_boxes_are_clipped_sliced_padded_and_shifted() -> None:
    assert Box(-5, -5, 10, 10).clipped(100, 100) == Box(0, 0, 5, 5)
    assert Box(200, 0, 10, 10).clipped(100, 100) is None
    rows, columns = Box(2.5, 1.2, 3, 2).slices(100, 100)
    assert (rows, columns) == (slice(1, 4), slice(2, 6))
    assert Box(2, 3, 4, 5).padded(1, 2).shifted(1, -1) == Box(2, 0, 6, 9)
    rows, columns = Box(200, 300, 3, 2).slices(100, 100)
    assert rows.start == rows.stop
    assert columns.start == columns.stop


@given(boxes, boxes)
def test_iou_is_symmetric_and_bounded(a: Box, b: Box) -> None:
    assert 0 <= a.iou(b) <= 1 + 1e-9
    assert a.iou(b) == pytest.approx(b.iou(a), abs=1e-12)
    assert a.iou(a) == pytest.approx(1)


@pytest.mark.parametrize(
    ('check', 'allowed', 'refused'),
    [
        (
            check_start_box,
            [Box(310, 230, 19, 19), Box(-480, -360, 1280, 960), Box(0, 0, 0.01, 8)],
            [
                *(Box(310, 9, 20, 9), Box(9, 230, 9, 20), Box(-9, 9, 18, 9), Box(9, -9, 9, 18)),
                *(Box(9, 9, 9, 7.9), Box(-500, 0, 1281, 9), Box(0, -400, 9, 961)),
            ],
        ),
        (
            check_matched_box,
            [Box(0, 0, 0.5, 0.5), Box(-1000, 0, 2560, 2500), Box.from_center(2720, 120, 9, 9)],
            [Box(0, 0, 9, 0.49), Box(-1000, 0, 2561, 9), Box.from_center(160, 2800, 9, 9)],
        ),
        (
            check_body,
            [BodyFrame(160, 120, 1e-9), BodyFrame(30_000, -30_000, 30_720, -7.0)],
            [
                *(BodyFrame(160, 120, height) for height in (30_721, 0.0, math.nan)),
                *(BodyFrame(31_000, 120, 9), BodyFrame(160, 120, 9, math.inf)),
            ],
        ),
    ],
)
def test_what_is_far_from_an_image_or_absurd_is_refused(
    check: Callable, allowed: list, refused: list
) -> None:
    for each in allowed:
        check(each, (320, 240))
    for each in refused:
        with pytest.raises(InputError, match='of 320 x 240'):
            check(each, (320, 240))


@given(bodies, sizes)
def test_body_frame_survives_its_corners(body: BodyFrame, width: float) -> None:
    again, wide = BodyFrame.from_corners(body.corners(width))
    assert wide == pytest.approx(width, rel=1e-6)
    assert again.height == pytest.approx(body.height, rel=1e-6)
    assert again.angle == pytest.approx(body.angle, abs=1e-6)
    assert again.center_x == pytest.approx(body.center_x, abs=1e-6)
    assert again.center_y == pytest.approx(body.center_y, abs=1e-6)
    with pytest.raises(InputError):
        BodyFrame.from_corners(((0, 0),) * 4)


@given(bodies)
def test_template_to_image_puts_head_and_feet_where_the_body_is(body: BodyFrame) -> None:
    transform = template_to_image(body, 96, 64, 0.9 * 96)
    middle = transform @ [32, 48, 1]
    head = transform @ [32, 48 - 0.45 * 96, 1]
    assert middle == pytest.approx([body.center_x, body.center_y], abs=1e-6)
    assert math.dist(middle, head) == pytest.approx(body.height / 2)
    # A positive angle leans the head to the right.
    assert head[0] - middle[0] == pytest.approx(math.sin(body.angle) * body.height / 2, abs=1e-6)


@given(bodies, sizes, sizes)
def test_a_grid_reaches_to_its_corners(body: BodyFrame, width: float, height: float) -> None:
    transform = template_to_image(body, 96, 64, 0.9 * 96)
    corners = transform @ [[0, width, width, 0], [0, 0, height, height], [1, 1, 1, 1]]
    sides = *corners.min(axis=1), *corners.max(axis=1)
    box = reach(transform, width, height)
    assert (box.x, box.y, box.right, box.bottom) == pytest.approx(sides, abs=1e-6)
