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


def test_another_speed_is_learnt_within_some_frames():
    # From 0.1 to 0.194 body heights a frame: 4.7 placements, of which 0.7 are left each time.
    x = [10.0 * k for k in range(6)] + [50 + 19.4 * k for k in range(1, 8)]
    found = [right for _, _, right in jumps([Box(each, 0, 40, 100) for each in x])]
    assert found == [0] * 6 + [5, 3, 2, 2, 0, 0, 0]
    y = [Box(0, -each, 40, 100) for each in x]
    assert jumps(y) == [(0, -jump, 0) for jump in found]


def test_after_a_pause_the_speed_is_measured_anew():
    motion = BoxMotion()
    for k in range(4):
        motion.update(Box(5.0 * k, 0, 40, 100), 0.1 * k, 0.02, 0.06)
    assert motion.update(Box(90, 0, 40, 100), 0.9, 0.02, 0.06) == (0, 0, 0)
    assert motion.update(Box(102.5, 0, 40, 100), 1.0, 0.02, 0.06) == (0, 0, 0)


def test_a_leap_is_not_taken_for_a_speed():
    leap = [*[Box(0, 0, 40, 100)] * 3, *[Box(100, 0, 40, 100)] * 3]
    # At most 2 body heights a second, of which 0.3 and then the rest are believed.
    assert [right for _, _, right in jumps(leap)] == [0, 0, 0, 50, -3, -2]
