# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Forward kinematics: where the joints of a walker are at every phase.

Axes of the body: x forward, y to the walker's left, z up, origin on the ground below the pelvis;
the unit is the stature.  Segment lengths are those of Drillis and Contini (1966) as printed by
Winter, *Biomechanics and Motor Control of Human Movement*.  The ground is under the lowest point
of both feet at every phase, so the rise and fall of the pelvis follows from the leg angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gait_segmentation.gait_model.kinematics import joint_angle

__all__ = ['SHANK', 'SIDES', 'THIGH', 'Frame', 'Points', 'Skeleton', 'walk']

Points = NDArray[np.float64]

SIDES = ('right', 'left')
THIGH, SHANK, TRUNK = 0.245, 0.246, 0.288
UPPER_ARM, FOREARM = 0.186, 0.146
HEEL_BACK, BALL_FRONT, SOLE, TOE = 0.033, 0.068, 0.039, 0.040
_HIP_HALF, _KNEE_HALF, _ANKLE_HALF = 0.050, 0.043, 0.031
_SHOULDER_HALF, _SHOULDER_DOWN = 0.098, 0.014
_TOE_OUT = np.deg2rad(8.0)
_ARM_OUT, _FOREARM_OUT = np.deg2rad(13.0), np.deg2rad(4.0)
# The norm set's arm angles are those of its model: a hanging arm looks straighter, and hangs
# farther to the front, by this much.
_ELBOW_OFFSET, _SHOULDER_OFFSET = np.deg2rad(10.0), np.deg2rad(6.0)
# A mean over people and laboratories is flatter than anybody's knee: single sets of the sources
# reach 64 to 67 degrees in swing, their mean 61.
_KNEE_RANGE = 1.1
_THORAX_ROTATION = -0.7  # of the pelvis' rotation: the shoulders turn against the hips


@dataclass(frozen=True)
class Frame:
    """A direction along a bone or block and the two across it, each (P, 3) unit vectors."""

    along: Points
    front: Points
    left: Points


@dataclass(frozen=True)
class Skeleton:
    """
    Joints and orientations at P phases; every point is (P, 3) in statures.

    Per side ('right', 'left'): hips, knees, ankles, heels, balls, toes, shoulders, elbows, wrists
    and the frames of thighs, shanks, feet, upper arms and forearms (``along`` points away from
    the trunk; that of a foot points to the toes).  ``trunk`` runs from the pelvis to the neck.
    """

    pelvis: Points
    neck: Points
    pelvis_frame: Frame
    thorax_frame: Frame
    joints: dict[str, Points]
    frames: dict[str, Frame]


def _vector(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Points:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1).astype(np.float64)


def _unit(vector: Points) -> Points:
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def _frame(along: Points, left: Points) -> Frame:
    """Complete a direction and a rough left to a right-handed frame."""
    along = _unit(along)
    front = _unit(np.cross(left, along))
    return Frame(along, front, np.cross(along, front))


def _leg(phase: Points, side: str, hip: Points, speed: float, shoe: float) -> tuple[dict, dict]:
    """Joints and frames of one leg; ``phase`` is the leg's own."""
    sign = 1.0 if side == 'left' else -1.0
    thigh = joint_angle('hip', phase, speed) - joint_angle('pelvis_tilt', phase)
    shank = thigh - joint_angle('knee', phase, speed, _KNEE_RANGE)
    foot = shank + joint_angle('ankle', phase, speed)
    adduction = sign * np.array([_KNEE_HALF - _HIP_HALF, _ANKLE_HALF - _KNEE_HALF])
    knee = hip + _vector(THIGH * np.sin(thigh), adduction[0], -THIGH * np.cos(thigh))
    ankle = knee + _vector(SHANK * np.sin(shank), adduction[1], -SHANK * np.cos(shank))
    cos, sin = np.cos(foot), np.sin(foot)
    # The toes stay near the ground while the heel rises.
    toe_angle = np.where(foot < 0, 0.3 * foot, foot)
    lateral = sign * np.sin(_TOE_OUT)

    def on_foot(forward: float, down: float) -> Points:
        return ankle + _vector(
            forward * cos + down * sin, lateral * forward, forward * sin - down * cos
        )

    ball = on_foot(shoe * BALL_FRONT, SOLE)
    length = shoe * TOE
    toe = ball + _vector(length * np.cos(toe_angle), lateral * length, length * np.sin(toe_angle))
    # Bones of limbs point down: with the rough left negated their front is the body's front.
    right = _vector(np.zeros_like(thigh), -1.0, 0.0)
    joints = {
        'hip': hip,
        'knee': knee,
        'ankle': ankle,
        'heel': on_foot(-shoe * HEEL_BACK, SOLE),
        'ball': ball,
        'toe': toe,
    }
    outward = _vector(np.full_like(thigh, -lateral), 1.0, 0.0)
    frames = {
        'thigh': _frame(knee - hip, right),
        'shank': _frame(ankle - knee, right),
        'foot': _frame(_vector(cos, lateral, sin), outward),
    }
    return joints, frames


def _arm(phase: Points, side: str, shoulder: Points, swing: float) -> tuple[dict, dict]:
    """Joints and frames of one arm; ``phase`` is that of the leg on the same side."""
    sign = 1.0 if side == 'left' else -1.0
    upper = joint_angle('shoulder', phase, amplitude=swing) + _SHOULDER_OFFSET
    bend = joint_angle('elbow', phase, amplitude=swing) - _ELBOW_OFFSET
    lower = upper + bend

    def direction(angle: Points, out: float) -> Points:
        cos_out = np.cos(out)
        return _vector(cos_out * np.sin(angle), sign * np.sin(out), -cos_out * np.cos(angle))

    upper_way, lower_way = direction(upper, _ARM_OUT), direction(lower, _FOREARM_OUT)
    elbow = shoulder + UPPER_ARM * upper_way
    wrist = elbow + FOREARM * lower_way
    right = _vector(np.zeros_like(upper), -1.0, 0.0)
    joints = {'shoulder': shoulder, 'elbow': elbow, 'wrist': wrist}
    frames = {'upper_arm': _frame(upper_way, right), 'forearm': _frame(lower_way, right)}
    return joints, frames


def walk(
    phase: ArrayLike,
    *,
    speed: float = 0.0,
    arm_swing: float = 1.0,
    arm_balance: float = 0.0,
    lean: float = 0.0,
    twist: float = 1.0,
    shoe: float = 1.0,
) -> Skeleton:
    """
    Pose the skeleton.

    :param phase: (P,) phases in cycles, 0 = heel contact of the right leg.
    :param speed: walking speed, -2 very slow .. 0 free .. 2 very fast.
    :param arm_swing: factor on the arms' swing about their mean.
    :param arm_balance: share of the swing that goes from the right arm to the left one, -1..1.
    :param lean: lean of the trunk beyond the usual, radians, positive forward.
    :param twist: factor on the turning of the hips, and of the shoulders against them.
    :param shoe: factor on the length of the feet.
    :returns: joints and frames at the P phases.
    """
    right = np.atleast_1d(np.asarray(phase, dtype=np.float64))
    phases = {'right': right, 'left': right + 0.5}
    rotation = twist * joint_angle(
        'pelvis_rotation', right
    )  # right hip forward: a turn to the left
    obliquity = joint_angle('pelvis_obliquity', right)  # right hip up
    left = _vector(-np.sin(rotation), np.cos(rotation), -np.sin(obliquity))
    tilt = joint_angle('thorax_tilt', right) + lean
    trunk = _vector(np.sin(tilt), 0.0, np.cos(tilt))
    turned = _THORAX_ROTATION * rotation
    thorax_left = _vector(-np.sin(turned), np.cos(turned), 0.0)
    pelvis = np.zeros((len(right), 3))
    neck = TRUNK * trunk
    joints: dict[str, Points] = {}
    frames: dict[str, Frame] = {}
    for side in SIDES:
        sign = 1.0 if side == 'left' else -1.0
        swing = arm_swing * (1 + sign * arm_balance)
        hip = sign * _HIP_HALF * left
        shoulder = neck + sign * _SHOULDER_HALF * thorax_left - _SHOULDER_DOWN * trunk
        for found, posed in (
            _leg(phases[side], side, hip, speed, shoe),
            _arm(phases[side], side, shoulder, swing),
        ):
            joints.update({f'{side}_{name}': value for name, value in found.items()})
            frames.update({f'{side}_{name}': value for name, value in posed.items()})
    ends = ('right_heel', 'right_ball', 'right_toe', 'left_heel', 'left_ball', 'left_toe')
    ground = np.min([joints[name][:, 2] for name in ends], axis=0)
    raise_by = _vector(0.0 * ground, 0.0, -ground)
    return Skeleton(
        pelvis + raise_by,
        neck + raise_by,
        _frame(trunk, left),
        _frame(trunk, thorax_left),
        {name: value + raise_by for name, value in joints.items()},
        frames,
    )
