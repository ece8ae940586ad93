# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.gait_model.kinematics import JOINTS, joint_angle, speed_law

# The norm curves every 5 % of the stride, degrees.
NORMS = {
    'hip': '36 36 33 28 22 17 11 6 2 -2 -4 -4 1 11 21 28 34 37 37 36 36',
    'knee': '6 14 20 20 17 13 10 8 7 9 14 23 38 53 61 60 51 35 17 5 6',
    'ankle': '-1 -5 -1 3 6 8 9 10 12 13 11 2 -13 -16 -9 -2 2 3 2 0 -1',
    'shoulder': '-24 -24 -22 -19 -15 -10 -5 -1 4 6 6 4 0 -3 -5 -8 -12 -16 -20 -22 -24',
    'elbow': '27 26 26 27 29 32 37 41 45 48 51 51 49 45 40 35 32 30 29 28 27',
}


@pytest.mark.parametrize('joint', sorted(NORMS))
def test_curves_follow_the_norm_data(joint):
    norm = np.array(NORMS[joint].split(), dtype=float)
    angle = np.rad2deg(joint_angle(joint, np.arange(21) / 20))
    assert np.sqrt(np.mean((angle - norm) ** 2)) < 1.0


@given(st.sampled_from(JOINTS), st.floats(-3, 3), st.floats(-2, 2))
def test_angles_repeat_after_a_stride(joint, phase, speed):
    now, later = joint_angle(joint, phase, speed), joint_angle(joint, phase + 1, speed)
    assert now == pytest.approx(later, abs=1e-9)


def test_amplitude_scales_the_swing_and_keeps_the_mean():
    phases = np.arange(100) / 100
    usual, double = joint_angle('shoulder', phases), joint_angle('shoulder', phases, 0.0, 2.0)
    assert double.mean() == pytest.approx(usual.mean())
    assert np.ptp(double) == pytest.approx(2 * np.ptp(usual))


def test_speed_law_at_its_nodes_and_between():
    assert speed_law('hip', 0.0) == (1.0, 0.0)
    assert speed_law('knee', -2.0) == (0.71, pytest.approx(np.deg2rad(-6.7)))
    assert speed_law('hip', 1.5)[0] == pytest.approx((1.15 + 1.24) / 2)
    assert speed_law('elbow', 2.0) == (1.0, 0.0)
