# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from gait_segmentation.gait_model.raster import draw, hull_outline

CORNERS = 96
ONE = np.ones(1, dtype=np.uint8)


def ellipse(width, height):
    axes = np.zeros((1, 2, 3))
    axes[0, 0, 0], axes[0, 1, 1] = width, height
    return axes


def outline_of(centers, axes, members, count=4):
    angles = 2 * np.pi * np.arange(count) / count
    outline = np.empty((count, 2))
    hull_outline(centers, axes, np.array(members), np.cos(angles), np.sin(angles), outline)
    return outline


def test_outline_of_an_ellipse_touches_its_axes():
    found = outline_of(np.array([[10.0, 5.0]]), ellipse(4.0, 2.0), [0])
    assert found == pytest.approx(np.array([[14, 5], [10, 7], [6, 5], [10, 3]]), abs=1e-9)


def test_outline_of_a_hull_takes_the_member_that_reaches_farthest():
    axes = np.concatenate([ellipse(1.0, 1.0), ellipse(2.0, 2.0)])
    found = outline_of(np.array([[0.0, 0.0], [8.0, 0.0]]), axes, [0, 1])
    assert found[:, 0] == pytest.approx([10, 8, -1, 8], abs=1e-9)


def inside(outline, shape):
    """Return which pixels have their centre inside of a convex outline."""
    rows, columns = np.indices(shape) + 0.5
    along = np.roll(outline, -1, axis=0) - outline
    across = [
        dx * (rows - y) - dy * (columns - x)
        for (x, y), (dx, dy) in zip(outline, along, strict=True)
    ]
    return np.min(across, axis=0) > 0


shapes = given(st.floats(4, 28), st.floats(0.4, 1.0), st.floats(30, 34), st.floats(30, 34))


@shapes
@example(5.5, 1.0, 32.0, 32.0)
@settings(max_examples=50)
def test_pixels_are_set_where_their_centre_lies_inside(size, ratio, x, y):
    canvas = np.zeros((64, 64), dtype=np.uint8)
    centers, axes = np.array([[x, y]]), ellipse(size, ratio * size)
    draw(canvas, centers, axes, ((0,),), ONE)
    outline = outline_of(centers, axes, [0], CORNERS)
    # A centre on the outline itself is on either side of it, as the last bit has it.
    least, most = (
        inside(centers + (outline - centers) * by, canvas.shape) for by in (1 - 1e-9, 1 + 1e-9)
    )
    assert not (least & (canvas == 0)).any()
    assert not (~most & (canvas == 1)).any()


@shapes
@example(5.5, 1.0, 32.0, 32.0)
@settings(max_examples=50)
def test_area_is_neither_grown_nor_shrunk(size, ratio, x, y):
    """
    Areas hold on average over all places within a pixel.

    At one place they need not: of a disc of radius 5.5 about the corner of a pixel 88 centres lie
    inside, 7 less than its area.  What holds is that a convex figure of area A and perimeter P
    has A - P / 2 to A + P / 2 + 1 points of the unit grid inside (Nosarzewska 1948).  The places
    at steps of 1 / n together make a grid n times as fine, on which the same says that the mean
    is within P / 2n + 1 / n^2 of A.
    """
    steps = 8
    width, height = size, ratio * size
    count = 0
    for place in np.ndindex(steps, steps):
        canvas = np.zeros((64, 64), dtype=np.uint8)
        draw(
            canvas,
            np.array([[x, y]]) + np.array(place) / steps,
            ellipse(width, height),
            ((0,),),
            ONE,
        )
        count += int(canvas.sum())
    area = np.pi * width * height
    # The outline is inscribed.  Between corners that are t apart as angles of the ellipse it
    # leaves out width * height * (t - sin t) / 2, at most t^3 / 12 of width * height.
    apart = 2 * np.pi / CORNERS / ratio
    left_out = area * apart**2 / 6
    perimeter = np.pi * np.sqrt(2 * (width**2 + height**2))  # at most
    error = count / steps**2 - area
    assert -left_out - perimeter / (2 * steps) <= error
    assert error <= perimeter / (2 * steps) + 1 / steps**2


def test_what_lies_outside_of_the_canvas_is_left_out():
    canvas = np.zeros((8, 8), dtype=np.uint8)
    for x, y in ((-50.0, 4.0), (50.0, 4.0), (4.0, -50.0), (4.0, 50.0)):
        draw(canvas, np.array([[x, y]]), ellipse(3.0, 3.0), ((0,),), ONE)
    assert not canvas.any()
    draw(canvas, np.array([[4.0, 4.0]]), ellipse(100.0, 100.0), ((0,),), ONE)
    assert canvas.all()


def test_later_pieces_cover_earlier_ones():
    canvas = np.zeros((9, 9), dtype=np.uint8)
    centers = np.array([[4.5, 4.5], [4.5, 4.5]])
    axes = np.concatenate([ellipse(4.0, 4.0), ellipse(1.0, 1.0)])
    draw(canvas, centers, axes, ((0,), (1,)), np.array([3, 7], dtype=np.uint8))
    assert canvas[4, 4] == 7
    assert canvas[4, 1] == 3
