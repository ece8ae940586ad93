# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.gait_model.projection import extent, project, view_matrix
from gait_segmentation.gait_model.solid import Body

angles = st.floats(-4, 4)


@given(angles, st.floats(-1, 1))
def test_views_are_rigid(azimuth, elevation):
    view = view_matrix(azimuth, elevation)
    assert view @ view.T == pytest.approx(np.eye(3), abs=1e-9)


@pytest.mark.parametrize(
    ('azimuth', 'right', 'away'),
    [(0, 1, 0), (np.pi / 2, 0, 1), (np.pi, -1, 0), (-np.pi / 2, 0, -1)],
)
def test_azimuth_is_the_walking_direction(azimuth, right, away):
    forward = view_matrix(azimuth) @ (1, 0, 0)
    assert forward == pytest.approx((right, 0, away), abs=1e-12)


def test_the_left_hand_is_on_the_left_of_somebody_walking_away():
    assert (view_matrix(np.pi / 2) @ (0, 1, 0))[0] == pytest.approx(-1)


def test_up_is_up_and_a_camera_looking_down_sees_the_head_nearer():
    down, away = (view_matrix(0.0, 0.3) @ (0, 0, 1))[1:]
    assert down < 0
    assert away < 0


def test_extent_of_a_ball_and_a_disc():
    ball = np.eye(3) * 0.5
    disc = np.diag([0.25, 0.25, 0.0])
    body = Body(
        np.array([[[0.0, 0.0, 2.0], [3.0, 0.0, 0.0]]]), np.array([[ball, disc]]), ((0, 1),), (0,)
    )
    centers, axes, away = project(body, 0.0)
    left, top, right, bottom = extent(centers, axes)
    assert (left[0], right[0]) == pytest.approx((-0.5, 3.25))
    assert (top[0], bottom[0]) == pytest.approx((-2.5, 0.0))
    assert away == pytest.approx(np.zeros((1, 2)))
