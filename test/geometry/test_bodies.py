# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import pytest
from hypothesis import given

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box, Placement, body_window, check_body
from test.geometry.strategies import bodies, sizes


@given(bodies, sizes)
def test_body_frame_survives_its_corners(body: BodyFrame, width: float) -> None:
    again, wide = BodyFrame.from_corners(body.corners(width))
    assert wide == pytest.approx(width, rel=1e-6)
    assert again.height == pytest.approx(body.height, rel=1e-6)
    assert again.angle == pytest.approx(body.angle, abs=1e-6)
    assert again.center_x == pytest.approx(body.center_x, abs=1e-6)
    assert again.center_y == pytest.approx(body.center_y, abs=1e-6)


@pytest.mark.parametrize(
    'corners',
    [(), ((0, 0), (1, 0), (1, 1)), ((0, 0),) * 4, ((0, 0), (math.nan, 0), (1, 1), (0, 1))],
)
def test_what_spans_no_rectangle_is_refused(corners: tuple) -> None:
    with pytest.raises(InputError, match='corners'):
        BodyFrame.from_corners(corners)


def test_the_window_about_a_body_holds_the_box_given() -> None:
    plain = body_window(100, 80, 50)
    assert (plain.x, plain.y) == (pytest.approx(74), pytest.approx(49))
    assert (plain.width, plain.height) == (pytest.approx(52), pytest.approx(62))
    held = body_window(100, 80, 50, Box(60, 70, 10, 10))
    assert (held.x, held.right) == (pytest.approx(54), pytest.approx(plain.right))
    assert (held.y, held.bottom) == (pytest.approx(plain.y), pytest.approx(plain.bottom))


def test_placement_is_in_heights_of_the_box() -> None:
    body = Placement(0.1, -0.2, 1.1).body(Box(10, 20, 30, 100), 0.2)
    assert body == BodyFrame(25 + 10, 70 - 20, pytest.approx(110), 0.2)


@pytest.mark.parametrize(
    'body',
    [BodyFrame(160, 120, 1e-9), BodyFrame(30_000, -30_000, 30_720), BodyFrame(0, 0, 9, -7.0)],
    ids=str,
)
def test_bodies_about_the_image_make_sense(body: BodyFrame) -> None:
    check_body(body, (320, 240))


@pytest.mark.parametrize(
    'body',
    [
        BodyFrame(160, 120, 30_721),
        BodyFrame(160, 120, 1e7),
        BodyFrame(160, 120, 0.0),
        BodyFrame(160, 120, math.nan),
        BodyFrame(31_000, 120, 9),
        BodyFrame(160, -math.inf, 9),
        BodyFrame(math.nan, 120, 9),
        BodyFrame(160, 120, 9, math.inf),
    ],
    ids=str,
)
def test_absurd_bodies_do_not(body: BodyFrame) -> None:
    with pytest.raises(InputError, match=r'at most 30720 pixels high and .* of 320 x 240, got x '):
        check_body(body, (320, 240))
