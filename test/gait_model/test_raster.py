# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gait_segmentation.gait_model.raster import draw, hull_outline

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


@given(st.floats(4, 28), st.floats(0.4, 1.0), st.floats(30, 34), st.floats(30, 34))
@settings(max_examples=50, deadline=None)
def test_area_is_neither_grown_nor_shrunk(size, ratio, x, y):
    canvas = np.zeros((64, 64), dtype=np.uint8)
    width, height = size, ratio * size
    draw(canvas, np.array([[x, y]]), ellipse(width, height), ((0,),), ONE)
    rim = 2 * (width + height)
    assert abs(canvas.sum() - np.pi * width * height) < 0.2 * rim + 2


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
