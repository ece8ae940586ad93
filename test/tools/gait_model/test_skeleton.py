# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gait_tools.gait_model.skeleton import (
    SEGMENTS,
    SIDES,
    WALKER,
    joint_angle,
    speed_law,
    walk,
)

PHASES = np.arange(60) / 60
FEET = ('heel', 'ball', 'toe')


def lengths(first, second):
    return np.linalg.norm(second - first, axis=1)


@given(st.floats(-2, 2), st.floats(0, 2))
@settings(max_examples=20)
def test_feet_are_never_below_ground_and_one_always_on_it(speed, swing):
    pose = walk(PHASES, speed=speed, arm_swing=swing)
    lowest = np.min([pose.joints[f'{s}_{f}'][:, 2] for s in SIDES for f in FEET], axis=0)
    assert np.abs(lowest).max() < 1e-12


def test_the_ball_stays_down_while_the_heel_rises():
    joints = walk(PHASES).joints
    heel, ball = (joints[f'right_{name}'][:, 2] for name in ('heel', 'ball'))
    stance = PHASES < 0.55
    assert heel[stance].max() > 0.05
    assert ball[stance & (heel > 0.02)].max() < 0.01


def test_step_length_is_that_of_walking():
    joints = walk([0.0]).joints
    step = joints['right_heel'][0, 0] - joints['left_heel'][0, 0]
    assert 0.36 < step < 0.44


def test_pelvis_rises_and_falls_twice_a_stride():
    height = walk(PHASES).pelvis[:, 2]
    assert 0.015 < np.ptp(height) < 0.03
    assert 0.50 < height.mean() < 0.54
    assert height == pytest.approx(np.roll(height, 30), abs=1e-9)


def test_bones_keep_their_lengths():
    pose = walk(PHASES, speed=1.0)
    for side in SIDES:
        joints = {
            name: pose.joints[f'{side}_{name}']
            for name in ('hip', 'knee', 'ankle', 'shoulder', 'elbow', 'wrist')
        }
        assert lengths(joints['hip'], joints['knee']) == pytest.approx(SEGMENTS['thigh'], rel=0.01)
        assert lengths(joints['knee'], joints['ankle']) == pytest.approx(
            SEGMENTS['shank'], rel=0.01
        )
        assert lengths(joints['shoulder'], joints['elbow']) == pytest.approx(SEGMENTS['upper_arm'])
        assert lengths(joints['elbow'], joints['wrist']) == pytest.approx(SEGMENTS['forearm'])
    assert lengths(pose.pelvis, pose.neck) == pytest.approx(SEGMENTS['trunk'], rel=0.001)


def test_left_limbs_do_half_a_stride_later_what_the_right_ones_do():
    now, later = walk(PHASES), walk(PHASES + 0.5)
    for name in ('knee', 'heel', 'toe', 'elbow', 'wrist'):
        mirrored = later.joints[f'left_{name}'] * (1, -1, 1)
        assert now.joints[f'right_{name}'] == pytest.approx(mirrored, abs=1e-9)


def test_heel_contact_of_the_right_leg_is_phase_zero():
    joints = walk([0.0]).joints
    assert joints['right_heel'][0, 0] > 0.1 > -0.1 > joints['left_heel'][0, 0]
    assert joints['right_heel'][0, 2] < joints['right_toe'][0, 2]
    # The arm swings with the leg of the other side.
    assert joints['left_wrist'][0, 0] > joints['right_wrist'][0, 0]


def test_frames_are_orthonormal_and_face_ahead():
    pose = walk(PHASES)
    frames = [pose.pelvis_frame, pose.thorax_frame, *pose.frames.values()]
    for frame in frames:
        axes = np.stack([frame.along, frame.front, frame.left], axis=-1)
        assert np.swapaxes(axes, 1, 2) @ axes == pytest.approx(
            np.broadcast_to(np.eye(3), axes.shape), abs=1e-9
        )
    assert (pose.thorax_frame.front[:, 0] > 0.9).all()
    assert (pose.frames['right_thigh'].front[:, 0] > 0.7).all()


@given(st.floats(0.7, 1.5))
@settings(max_examples=10)
def test_larger_feet_are_longer_and_stay_on_the_ground(shoe):
    usual, pose = walk(PHASES), walk(PHASES, shoe=shoe)
    for side in SIDES:
        length = [
            lengths(joints[f'{side}_heel'], joints[f'{side}_ball'])
            for joints in (usual.joints, pose.joints)
        ]
        assert length[1] == pytest.approx(shoe * length[0], rel=1e-6)
    lowest = np.min([pose.joints[f'{s}_{f}'][:, 2] for s in SIDES for f in FEET], axis=0)
    assert np.abs(lowest).max() < 1e-12


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


@given(st.sampled_from(sorted(WALKER['joints'])), st.floats(-3, 3), st.floats(-2, 2))
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
