# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows about people."""

from __future__ import annotations

import numpy as np

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.windows import windows_about

SHAPE = (120, 300)
STILL = WorldMotion()


def test_without_people_it_is_all_of_the_image() -> None:
    assert windows_about([], STILL, SHAPE) == [(slice(0, 120), slice(0, 300))]


def test_there_is_room_about_people_and_the_camera_moves_them() -> None:
    (one,) = windows_about([Box(100, 30, 30, 50)], STILL, SHAPE)
    assert one[0].start < 30
    assert one[0].stop > 80
    assert one[1].start < 100
    assert one[1].stop > 130
    camera = np.array([[1.0, 0.0, 20.0], [0.0, 1.0, 0.0]])
    (two,) = windows_about([Box(100, 30, 30, 50)], WorldMotion(camera), SHAPE)
    assert two == (one[0], slice(one[1].start + 20, one[1].stop + 20))


def test_people_who_are_near_share_a_window() -> None:
    near = [Box(40, 30, 30, 50), Box(75, 30, 30, 50), Box(220, 30, 30, 50)]
    windows = windows_about(near, STILL, SHAPE)
    assert len(windows) == 2
    assert windows[0][1].stop <= windows[1][1].start


def test_people_out_of_the_image_have_no_window() -> None:
    assert windows_about([Box(400, 30, 30, 50)], STILL, SHAPE) == []
