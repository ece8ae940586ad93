# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from gait_segmentation.geometry import Box
from gait_segmentation.matching.box_motion import BoxMotion


def jumps(boxes):
    motion = BoxMotion()
    return [motion.update(box, 0.1 * k, 0.02, 0.06) for k, box in enumerate(boxes)]


def test_steady_motion_is_no_jump():
    assert set(jumps([Box(9.0 * k, 0, 40, 100) for k in range(9)])) == {(0, 0, 0)}


def test_tells_jumps_in_placements():
    still = [Box(0, 0, 40, 100)] * 3
    assert jumps([*still, Box(8, -6, 40, 100)])[-1] == (0, -3, 4)
    assert jumps([*still, Box.from_center(20, 50, 40, 120)])[-1] == (3, 0, 0)
